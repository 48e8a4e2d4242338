"""The forms: consent, NASA-TLX and the System Usability Scale, with their items and scores; pure.

NASA-TLX has six scales of 21 marks, 0 to 100 in steps of 5 (Hart and Staveland, Development of NASA-TLX, in Human
Mental Workload, 1988). The score is the mean of the scales, without weights from comparisons of pairs ("raw TLX": Hart,
NASA-Task Load Index; 20 years later, Proc. Human Factors and Ergonomics Society 50, 2006).

SUS has ten items with five answers, 1 strongly disagree to 5 strongly agree. Odd items count the answer minus 1, even
ones 5 minus the answer; the score is 2.5 times their sum, 0 to 100 (Brooke, SUS: a quick and dirty usability scale, in
Usability Evaluation in Industry, 1996).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from handsteer.errors import StudyError
from handsteer.plugins.study.plan import FormName


@dataclass(frozen=True)
class Item:
    """A question of a form.

    Attributes:
        name: Its column in the results.
        title: A short title; empty if it has none.
        question: What is asked.
        ends: The meaning of the lowest and of the highest answer.
    """

    name: str
    title: str
    question: str
    ends: tuple[str, str]


@dataclass(frozen=True)
class Form:
    """A form.

    Attributes:
        title: Its heading.
        answers: The answers to each item, lowest first.
        items: Its questions.
    """

    title: str
    answers: tuple[int, ...]
    items: tuple[Item, ...]


_TLX: Final = (
    ("mental", "Mental demand", "How mentally demanding was the task?", ("Very low", "Very high")),
    ("physical", "Physical demand", "How physically demanding was the task?", ("Very low", "Very high")),
    ("temporal", "Temporal demand", "How hurried or rushed was the pace of the task?", ("Very low", "Very high")),
    (
        "performance",
        "Performance",
        "How successful were you in accomplishing what you were asked to do?",
        ("Perfect", "Failure"),
    ),
    (
        "effort",
        "Effort",
        "How hard did you have to work to accomplish your level of performance?",
        ("Very low", "Very high"),
    ),
    (
        "frustration",
        "Frustration",
        "How insecure, discouraged, irritated, stressed, and annoyed were you?",
        ("Very low", "Very high"),
    ),
)
_SUS: Final = (
    "I think that I would like to use this system frequently.",
    "I found the system unnecessarily complex.",
    "I thought the system was easy to use.",
    "I think that I would need the support of a technical person to be able to use this system.",
    "I found the various functions in this system were well integrated.",
    "I thought there was too much inconsistency in this system.",
    "I would imagine that most people would learn to use this system very quickly.",
    "I found the system very cumbersome to use.",
    "I felt very confident using the system.",
    "I needed to learn a lot of things before I could get going with this system.",
)
_AGREEMENT: Final = ("Strongly disagree", "Strongly agree")

FORMS: Final[Mapping[FormName, Form]] = {
    "tlx": Form(
        "How was driving this way?",
        tuple(range(0, 101, 5)),
        tuple(Item(f"tlx_{name}", title, question, ends) for name, title, question, ends in _TLX),
    ),
    "sus": Form(
        "How far do you agree? The system is this way of driving.",
        tuple(range(1, 6)),
        tuple(Item(f"sus_{number}", "", words, _AGREEMENT) for number, words in enumerate(_SUS, 1)),
    ),
}


def score(form: FormName, answers: Mapping[str, int]) -> float:
    """Return the score of ``form``, 0 to 100: the raw TLX, where more is more load, or the SUS, where more is better.

    Raises:
        StudyError: An item is missing, unknown, or its answer is not one of the form's.
    """
    _check(form, answers)
    values = [answers[item.name] for item in FORMS[form].items]
    if form == "tlx":
        return sum(values) / len(values)
    return 2.5 * sum(5 - value if index % 2 else value - 1 for index, value in enumerate(values))


def _check(form: FormName, answers: Mapping[str, int]) -> None:
    names = [item.name for item in FORMS[form].items]
    possible = FORMS[form].answers
    for number, name in enumerate(names, 1):
        if name not in answers:
            raise StudyError(f"question {number} has no answer yet")
        if isinstance(answers[name], bool) or answers[name] not in possible:
            raise StudyError(
                f"question {number}: {answers[name]!r} is not a valid answer: {possible[0]} to {possible[-1]} are"
            )
    if unknown := answers.keys() - set(names):
        raise StudyError(f"{form} has no item {min(unknown)}")
