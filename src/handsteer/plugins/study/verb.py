"""``handsteer study``: lead people through a study on the page."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from handsteer.cli.app import ConfigFile, PageOptions, loads
from handsteer.cli.running import say
from handsteer.cli.running import settings as make_settings
from handsteer.errors import StudyError

if TYPE_CHECKING:
    from handsteer.plugins.study.plan import Plan


@loads("handsteer.cli.drive", "handsteer.plugins.study.results", "tqdm")
def study(
    plan: Path,
    *,
    participant: str | None = None,
    results: Path | None = None,
    camera: str | None = None,
    page: PageOptions = PageOptions(),  # noqa: B008 - it is frozen
    config_file: ConfigFile = None,
) -> int:
    """Lead a person through the interfaces and courses of a plan on the page, and write CSV.

    For example:
      handsteer study plan.yaml                    check it; who has done what
      handsteer study plan.yaml --participant P01  lead P01 through it

    Parameters
    ----------
    plan
        YAML file with the plan: docs/study.md.
    participant
        Id of the participant; the same command continues an interrupted study. Without it, the plan is checked, and
        the order and the progress of each participant are printed.
    results
        Folder of the results; by default the name of the plan's file with -results, in the working directory.
    camera
        auto, virtual, browser (of the device that shows the page), a webcam's index or /dev/videoN, or an address.
    config_file
        YAML file with parameters; options override it, and the plan overrides both.
    """
    from handsteer.cli.drive import drive
    from handsteer.cli.installation import fetch_missing
    from handsteer.plugins.study.order import order_of
    from handsteer.plugins.study.plan import course_file, load_configs, load_courses, read_plan
    from handsteer.plugins.study.results import locked, prepare
    from handsteer.plugins.study.session import Session, Task

    the_plan = read_plan(plan)
    first = order_of(the_plan, participant)[1][0] if participant in the_plan.participants else the_plan.courses[0]
    shorthand = {
        "robot": {"world": course_file(first, plan)},
        "camera": {"source": camera},
        "dashboard": page.parameters(),
    }
    base = make_settings(config_file, None, shorthand).model_dump(exclude_unset=True)
    courses, configs = load_courses(the_plan, plan), load_configs(the_plan, plan, base)
    folder = results or Path(f"{plan.stem}-results")

    task = partial(Task, the_plan, courses=courses, configs=configs, results=folder)
    if participant is None:
        _list(the_plan, {person: Session(task(person)).progress for person in the_plan.participants})
        return 0
    done, steps = Session(task(participant)).progress
    if done == steps:
        raise StudyError(f"{participant} has done all of {plan}: the results are in {folder}")
    first_config = next(iter(configs.values()))
    fetch_missing(first_config)
    prepare(folder)
    with locked(folder):
        say(f"{participant}: {done} of {steps} laps and forms are done; the results are written to {folder}")
        drive(first_config, study=task(participant))
    return 0


def _list(plan: "Plan", progress: dict[str, tuple[int, int]]) -> None:
    from handsteer.plugins.study.order import group_size, order_of

    for person, (done, steps) in progress.items():
        conditions, courses = order_of(plan, person)
        print(f"{person}  {done:3d} of {steps}  {', '.join(conditions)}; courses {', '.join(courses)}")
    size = group_size(plan)
    if len(progress) % size:
        print(f"note: the conditions' order is balanced for each {size} participants; these are {len(progress)}")
