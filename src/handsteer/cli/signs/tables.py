"""Figures as text, as several verbs print them."""

from collections.abc import Sequence

from handsteer.training.custom.dataset import Dataset, summarise
from handsteer.training.custom.report import TrainingReport, false_hands, how_it_was_tried, mistakes
from handsteer.training.evaluation.intervals import Share
from handsteer.training.evaluation.photo_metrics import Confusion


def table(head: Sequence[str], rows: Sequence[Sequence[str]], text_columns: int = 1) -> str:
    """Return ``rows`` below ``head`` in columns; those after the first ``text_columns`` are set to the right."""
    lines = [head, *rows]
    widths = [max(len(line[column]) for line in lines) for column in range(len(head))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if column < text_columns else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def dataset_table(dataset: Dataset) -> str:
    """Return how much there is of each sign, as text."""
    rows = [[each.label, str(each.takes), str(each.rows), str(each.persons)] for each in summarise(dataset)]
    return table(["sign", "takes", "hands", "persons"], rows)


def teaching_tables(report: TrainingReport) -> str:
    """Return how well signs were learnt, as text."""
    rows = [
        [
            *(sign.summary.label, str(sign.summary.takes), str(sign.summary.rows), str(sign.summary.persons)),
            "as shown" if sign.sided else "either",
            *(cells(sign.recall) if sign.recall else ["-", "-", "-"]),
        ]
        for sign in report.signs
    ]
    parts = [
        how_it_was_tried(report),
        table(["sign", "takes", "hands", "persons", "hand", "right", "of", "recall"], rows),
        false_hands(report),
        *mistakes(report),
    ]
    return "\n\n".join([*parts, *confusion_table("hands", report.confusion)])


def confusion_table(what: str, confusion: Confusion) -> list[str]:
    """Return ``confusion`` with a headline; ``what`` is counted in it."""
    rows = [
        [label, *(str(count or ".") for count in counts)]
        for label, counts in zip(confusion.labels, confusion.counts, strict=True)
        if any(counts)
    ]
    head = f"Confusion, in {what}: a row for each sign that is shown, a column for each that came out"
    return [head, table(["shown", *confusion.labels], rows)]


def cells(share: Share) -> list[str]:
    """Return how many, of how many, and the rate, for a row of a table."""
    return [str(share.count), str(share.of), rate(share)]


def rate(share: Share) -> str:
    """Return the rate of ``share`` with its 95 % interval, as text."""
    if share.rate is None or share.interval is None:
        return "-"
    low, high = share.interval
    digits = 1 if high < 0.1 else 0
    return f"{share.rate:.1%} ({100 * low:.{digits}f}-{100 * high:.{digits}f})"
