"""``handsteer signs list``, ``train`` and ``export``: the known signs, and learning further ones from datasets."""

import json as json_format
import shlex
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from handsteer.cli.app import ConfigFile, Flag, Parameters, loads
from handsteer.cli.running import check_writable, default_file, say, settings, table
from handsteer.errors import ModelError, TrainingError

_LOW_RECALL = 0.8
_DATASET = Path("signs.npz")  # as teach.dataset and teach.model of the configuration
_MODEL = Path("my-signs.npz")


@loads("handsteer.control.explain", "handsteer.recognition.recognizer", "rich.table")
def list_signs(*, json: Flag = False, config_file: ConfigFile = None, parameters: Parameters = None) -> int:
    """Print the signs that the model knows, and what each makes the robot do.

    For example:
      handsteer signs list
      handsteer signs list --control.actions.Peace turbo  with your action
      handsteer signs list --json                         for programs

    Parameters
    ----------
    json
        Print one JSON list.
    config_file
        YAML file with parameters, each of which is an option too: `handsteer parameters`. Options override the file.
        Without it, handsteer.yaml of the working directory, if there is one, as in `handsteer run`.
    """
    from handsteer.plugins.teach.effects import effect_of
    from handsteer.recognition.recognizer import open_classifier
    from handsteer.types import NONE, action_of, find_sign

    config = settings(config_file or default_file(), parameters)
    actions = config.control.actions
    known = (*open_classifier(config.signs).signs, NONE)
    named = [sign for sign in actions if find_sign(sign, known) is None]
    signs = [
        {"sign": sign, "action": action, "effect": effect_of(action, config.control), "known": sign in known}
        for sign in (*known, *named)
        for action in [action_of(sign, actions)]
    ]
    if json:
        print(json_format.dumps(signs))
        return 0
    rows = [[str(sign["sign"]), str(sign["action"]), _effect(sign)] for sign in signs]
    print(table(["sign", "action", "the robot"], rows, text_columns=3))
    return 0


def _effect(sign: dict[str, object]) -> str:
    return f"{sign['effect']}{'' if sign['known'] else ' (unknown to the model)'}"


@loads(
    "handsteer.plugins.teach.verbs.tables", "handsteer.recognition.recognizer", "handsteer.plugins.teach.train", "tqdm"
)
def train(
    *datasets: Path,
    output: Path = _MODEL,
    sided: Annotated[list[str] | None, Parameter(consume_multiple=True, negative="")] = None,
    json: Flag = False,
) -> int:
    """Learn the signs of datasets, and print how well they are distinguished from each other and from other hands.

    For example:
      handsteer signs train                                signs.npz
      handsteer signs train a.npz b.npz --output ours.npz  several datasets

    The shipped signs do not change; a dataset's rows of them, and of NONE, are
    used as examples of other hands. Use the learnt signs with --signs.model
    my-signs.npz, and set what each does with --control.actions.Hi stop.

    Parameters
    ----------
    datasets
        Files written by `signs collect` and `signs import`; by default signs.npz.
    output
        File to write the learnt signs to.
    sided
        Signs that do not count when mirrored, as the other hand shows them; signs that point to a side never do.
    json
        Print one JSON object.
    """
    from tqdm import tqdm

    from handsteer.plugins.teach.background import BackgroundTraining
    from handsteer.plugins.teach.dataset import Dataset, load_dataset
    from handsteer.plugins.teach.verbs.tables import teaching_tables
    from handsteer.recognition.custom_signs import load_custom_model, save_custom_model

    if sided is not None and not sided:
        raise TrainingError("--sided needs a value: the signs, as in --sided Hi")
    check_writable("--output", output, TrainingError, load_custom_model)
    parts = [load_dataset(path) for path in datasets or (_DATASET,)]
    takes = tuple(take for part in parts for take in part.takes)
    dataset = Dataset(takes, frozenset().union(*(part.disabled for part in parts)))
    with tqdm(unit=" steps", file=sys.stderr, disable=not sys.stderr.isatty()) as bar:

        def progress(done: int, of: int) -> None:
            bar.total = of
            bar.update(done - bar.n)

        learnt = BackgroundTraining(dataset, sided or ()).run(progress)
    assert learnt is not None  # it is never cancelled
    model, report = learnt
    save_custom_model(model, output)
    print(json_format.dumps({"model": str(output), **report.as_dict()}) if json else teaching_tables(report))
    for each in report.left_out:
        say(f"left out: {each.why}")
    for sign in report.signs:
        if sign.recall is not None and (sign.recall.rate or 0) < _LOW_RECALL:
            say(f"{sign.summary.label} is recognised poorly: collect more takes, in every way you will show it")
    say(f"the learnt signs are in {output}: drive with --signs.model {shlex.quote(str(output))}")
    return 0


@loads("handsteer.plugins.teach.onnx_file")
def export(model: Path, output: Path, /) -> int:
    """Write taught signs as an ONNX file, which computes their confidences from MediaPipe's landmarks.

    For example:
      handsteer signs export my-signs.npz my-signs.onnx

    ONNX Runtime runs the file without handsteer; docs/teach.md says how.

    Parameters
    ----------
    model
        File written by `signs train`, or downloaded from the page.
    output
        File to write; it must not exist.
    """
    from handsteer.plugins.teach.onnx_file import save_onnx
    from handsteer.recognition.custom_signs import load_custom_model

    if output.exists():
        raise ModelError(f"{output} exists already: give another name, nothing is overwritten")
    check_writable("OUTPUT", output, ModelError)
    learnt = load_custom_model(model)
    save_onnx(learnt, output)
    say(f"{', '.join(learnt.labels)}: as ONNX in {output}")
    return 0
