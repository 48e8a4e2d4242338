"""The steps of each participant, in an order that is balanced over all participants; pure.

Conditions follow a Williams design: a Latin square in which each condition also follows each other one equally often
(Williams, E. J., Experimental designs balanced for the estimation of residual effects of treatments, Australian Journal
of Scientific Research A 2, 1949). Courses do likewise.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from handsteer.plugins.study.plan import FormName, Plan

Kind = Literal["consent", "instructions", "lap", "form", "thanks"]


@dataclass(frozen=True)
class Step:
    """One step of a participant.

    Attributes:
        kind: What is done in it.
        order: Place of its condition in the participant's order, from 1; 0 outside of conditions.
        condition: Name of its condition; empty outside of conditions.
        course: Name of its course; empty unless it is a lap.
        practice: Whether it is a practice lap.
        lap: Number of the lap, from 1, of the practice or the measured laps on this course under this condition.
        form: Name of the form; empty unless it is a form.
    """

    kind: Kind
    order: int = 0
    condition: str = ""
    course: str = ""
    practice: bool = False
    lap: int = 0
    form: FormName | Literal[""] = ""

    @property
    def is_recorded(self) -> bool:
        """Whether the results have a row of it."""
        return self.kind not in ("instructions", "thanks")


def williams(count: int) -> tuple[tuple[int, ...], ...]:
    """Return the rows of a Williams design of ``count`` treatments, 0 to ``count - 1``.

    Each treatment is once in each row, equally often at each place, and equally often directly after each other one.
    There are ``count`` rows if it is even or 1, else twice as many.
    """
    first = [(index + 1) // 2 if index % 2 else (count - index // 2) % count for index in range(count)]
    rows = [tuple((each + shift) % count for each in first) for shift in range(count)]
    if count % 2 and count > 1:
        rows += [row[::-1] for row in rows]
    return tuple(rows)


def order_of(plan: Plan, participant: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the order of conditions and of courses for ``participant``.

    The conditions repeat after as many participants as their design has rows. From one such group to the next the
    courses move on by a row, so that all combinations occur.
    """
    number = plan.participants.index(participant)
    conditions, courses = williams(len(plan.conditions)), williams(len(plan.courses))
    group, row = divmod(number, len(conditions))
    return (
        tuple(plan.conditions[index].name for index in conditions[row]),
        tuple(plan.courses[index] for index in courses[(row + group) % len(courses)]),
    )


def group_size(plan: Plan) -> int:
    """Return the number of participants, or a divisor of it, with which the order of conditions is balanced."""
    return len(williams(len(plan.conditions)))


def steps_of(plan: Plan, participant: str) -> tuple[Step, ...]:
    """Return all steps of ``participant``, in order."""
    conditions, courses = order_of(plan, participant)
    steps = [Step("consent")]
    for order, condition in enumerate(conditions, 1):
        steps.append(Step("instructions", order, condition))
        steps.extend(_laps(plan, order, condition, courses))
        steps.extend(Step("form", order, condition, form=form) for form in plan.forms)
    return (*steps, Step("thanks"))


def _laps(plan: Plan, order: int, condition: str, courses: tuple[str, ...]) -> Iterator[Step]:
    for course in courses:
        for practice, count in ((True, plan.practice_laps), (False, plan.laps)):
            for lap in range(1, count + 1):
                yield Step("lap", order, condition, course, practice, lap)
