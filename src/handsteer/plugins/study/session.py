"""The session of one participant: which step is next, the lap that is being driven, and what is written about it.

It moves nothing and shows nothing. It belongs to one thread.
"""

import datetime
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from handsteer import __version__
from handsteer.config import Config
from handsteer.errors import StudyError
from handsteer.plugins.study.forms import score
from handsteer.plugins.study.order import Step, steps_of
from handsteer.plugins.study.plan import Plan, plan_hash
from handsteer.plugins.study.results import REPEATED, Results
from handsteer.robots.world import World
from handsteer.types import CourseState

Outcome = Literal["finished", "limit", "given_up", "repeated"]
"""How a lap ended: at the last gate, by the time limit, given up, or interrupted and driven again."""


@dataclass(frozen=True)
class Task:
    """Everything that leads one participant through a study.

    Attributes:
        plan: The plan.
        participant: Id of the participant.
        courses: The world of each course by its name in the plan.
        configs: The configuration of each condition by its name.
        results: Folder of the results.
    """

    plan: Plan
    participant: str
    courses: Mapping[str, World]
    configs: Mapping[str, Config]
    results: Path


@dataclass(frozen=True)
class Lap:
    """The lap in progress.

    Attributes:
        viewer: The viewer of the page that drives it.
        begun_s: When it began, in seconds of the graph's clock.
        started_utc: The same in UTC.
        course: The referee's newest report; None until it reports the new lap.
        start_m: Path length at the start gate; None before it.
        end_m: The newest path length.
    """

    viewer: str
    begun_s: float
    started_utc: str
    course: CourseState | None = None
    start_m: float | None = None
    end_m: float = 0.0

    @property
    def path_m(self) -> float:
        """Distance driven since the start gate, in metres."""
        return 0.0 if self.start_m is None else max(0.0, self.end_m - self.start_m)


class Session:
    """Leads one participant; continues at the first step that is not in the results.

    Args:
        task: What is to be done.

    Raises:
        StudyError: The participant is not in the plan, or the results cannot be used.

    Attributes:
        task: What is to be done.
        lap: The lap in progress, if any.
        last: The row of the lap before; None before the first one of this session.
    """

    def __init__(self, task: Task) -> None:
        if task.participant not in task.plan.participants:
            known = ", ".join(task.plan.participants[:20])
            raise StudyError(f"there is no participant {task.participant!r} in the plan: choose one of {known}")
        self.task = task
        self.lap: Lap | None = None
        self.last: Mapping[str, object] | None = None
        self._results = Results(task.results)
        self._plan_hash = plan_hash(task.plan, dict(task.courses))
        self._steps = steps_of(task.plan, task.participant)
        self._done = self._results.done(task.participant, self._plan_hash)
        if strange := self._done - set(self._steps):
            name = next(iter(strange)).condition
            raise StudyError(
                f"{task.results}: {task.participant} has rows of {name!r} that are not in their order: were the "
                "participants of the plan reordered?"
            )
        first = next((at for at, step in enumerate(self._steps) if self._is_to_do(step)), len(self._steps) - 1)
        self._index = first - 1 if self._steps[first - 1].kind == "instructions" else first

    @property
    def step(self) -> Step:
        """The current step."""
        return self._steps[self._index]

    @property
    def progress(self) -> tuple[int, int]:
        """Number of recorded steps, and of those that are to be recorded."""
        return len(self._done), sum(step.is_recorded for step in self._steps)

    @property
    def config(self) -> Config:
        """The configuration of the current step's condition."""
        return self.task.configs[self.step.condition]

    @property
    def world(self) -> World:
        """The world of the current lap's course."""
        return self.task.courses[self.step.course]

    def go_on(self) -> None:
        """Leave a step that is only read."""
        if self.step.kind == "instructions":
            self._index += 1

    def begin_lap(self, viewer: str, now_s: float) -> None:
        """Begin the current lap; has no effect if one is in progress, or this step is none."""
        if self.lap is None and self.step.kind == "lap":
            self.lap = Lap(viewer, now_s, _utc_now())

    def note(self, course: CourseState | None, path_m: float | None, now_s: float) -> Outcome | None:
        """Take the referee's report on the lap in progress; return how the lap has ended, or None.

        Reports of the lap before are ignored: a lap begins with one of a course that has not begun.

        Args:
            course: Progress on the course; None if unknown.
            path_m: Path length of the robot; None if unknown.
            now_s: Time in seconds of the graph's clock.

        Raises:
            StudyError: The row cannot be written.
        """
        lap = self.lap
        if lap is None:
            return None
        is_new = course is not None and course.phase == "ready" and course.gates == len(self.world.gates)
        if course is not None and (is_new or lap.course is not None):
            end_m = lap.end_m if path_m is None else path_m
            start_m = end_m if lap.start_m is None and course.phase != "ready" else lap.start_m
            lap = self.lap = replace(lap, course=course, start_m=start_m, end_m=end_m)
        outcome = self._ended(lap, now_s)
        if outcome is not None:
            self.end_lap(outcome)
        return outcome

    def end_lap(self, outcome: Outcome) -> None:
        """End the lap in progress, if any, and write its row; after ``repeated`` it is still to be driven.

        Raises:
            StudyError: The row cannot be written; the lap is still to be driven.
        """
        lap, self.lap = self.lap, None
        if lap is None:
            return
        step, course = self.step, lap.course or CourseState(len(self.world.gates))
        row = {
            **self._whose(),
            "course": step.course,
            "practice": int(step.practice),
            "lap": step.lap,
            "outcome": outcome,
            "phase": course.phase,
            "time_s": round(course.time_s, 3),
            "gates": course.gates,
            "passed": course.passed,
            "missed": len(course.missed),
            "bumps": course.bumps,
            "score_s": round(course.score_s, 3),
            "path_m": round(lap.path_m, 2),
            **self._of_run(lap.started_utc),
        }
        self._results.add_lap(row)
        self.last = row
        if outcome != REPEATED:
            self._finish()

    def agree(self) -> None:
        """Record the participant's consent.

        Raises:
            StudyError: It cannot be written.
        """
        if self.step.kind == "consent":
            self._results.add_form({**self._whose(), "form": "consent", **self._of_run(_utc_now())})
            self._finish()

    def submit(self, answers: Mapping[str, int]) -> None:
        """Record the answers to the current form.

        Raises:
            StudyError: An answer is missing or impossible, or the row cannot be written.
        """
        form = self.step.form
        if form:
            row = {**self._whose(), "form": form, "score": round(score(form, answers), 2), **answers}
            self._results.add_form({**row, **self._of_run(_utc_now())})
            self._finish()

    def _finish(self) -> None:
        self._done.add(self.step)
        while not (self._is_to_do(self.step) or self.step.kind in ("instructions", "thanks")):
            self._index += 1

    def _is_to_do(self, step: Step) -> bool:
        return step.is_recorded and step not in self._done

    def _ended(self, lap: Lap, now_s: float) -> Outcome | None:
        phase = lap.course.phase if lap.course else "ready"
        if phase == "finished":
            return "finished"
        elapsed_s = lap.course.time_s if lap.course and phase == "running" else now_s - lap.begun_s
        return "limit" if elapsed_s >= self.task.plan.lap_limit else None

    def _whose(self) -> dict[str, Any]:
        name = self.step.condition
        method = self.task.plan.condition(name).input if name else ""
        return {"participant": self.task.participant, "order": self.step.order, "condition": name, "input": method}

    def _of_run(self, started_utc: str) -> dict[str, str]:
        config = self._results.keep_config(self.config) if self.step.condition else ""
        return {"config": config, "plan": self._plan_hash, "version": __version__, "started_utc": started_utc}


def _utc_now() -> str:
    return f"{datetime.datetime.now(datetime.UTC):%Y-%m-%dT%H:%M:%SZ}"
