"""Describes the results of a training in sentences."""

from handsteer.signs.teaching.train import TeachingReport
from handsteer.types import NONE


def how_it_was_tried(report: TeachingReport) -> str:
    """Return how the figures were measured, without a full stop."""
    tried = f"How well hands are told that were held out, one {report.held_out} after the other"
    return tried if report.held_out == "person" else f"{tried}; how well those of others are told, nobody knows yet"


def false_hands(report: TeachingReport) -> str:
    """Return how many hands of any shape are recognised as one of the signs."""
    rate = f"{report.made.rate or 0.0:.1%}"
    return f"Of made hands of all shapes, {rate} are told as one of these signs; some of them do show it."


def mistakes(report: TeachingReport) -> list[str]:
    """Return the confusions of signs, the most frequent first; may be empty."""
    labels, counts = report.confusion.labels, report.confusion.counts
    found = [
        (count / sum(row), f"{shown} is taken for {_sign(told)} {count} of {sum(row)} times")
        for shown, row in zip(labels, counts, strict=True)
        for told, count in zip(labels, row, strict=True)
        if count and shown != told
    ]
    found += [
        (each.hands.rate or 0.0, f"{each.label} is taken for {each.sign} {each.hands.count} of {each.hands.of} times")
        for each in report.known
    ]
    return [words for _, words in sorted(found, key=lambda item: -item[0])]


def _sign(told: str) -> str:
    return "no sign" if told == NONE else told
