"""The figures of an evaluation as text."""

from collections.abc import Sequence

from handsteer.signs.figures import SIZES, Confusion, PhotoReport, Share
from handsteer.signs.teaching.dataset import Dataset, summarise
from handsteer.signs.teaching.train import TeachingReport
from handsteer.signs.teaching.words import false_hands, how_it_was_tried, mistakes
from handsteer.signs.video_figures import Event, LabelledFigures, VideoReport


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


def photo_tables(report: PhotoReport, what: str = "photos") -> str:
    """Return the figures of photos as text; ``what`` they are called."""
    recall = [_recall_row(report, sign) for sign in report.recall]
    parts = [
        f"{len(report.results)} {what}, and {report.unscored} that are not scored",
        "Recall, in all and by the longer side of the hand; then how many hands were not found (they are wrong),\n"
        f"and how many {what} gave another sign that moves the robot",
        table(["sign", "right", "of", "recall", *SIZES, "moves"], recall),
    ]
    if report.false_commands.of:
        kinds = {**report.false_commands_by_kind, "all": report.false_commands}
        rows = [[kind or "(no kind)", *_cells(share)] for kind, share in kinds.items()]
        parts += [
            f"False commands: {what} that show no sign and gave one that moves the robot",
            table(["kind", "false", "of", "rate"], rows),
        ]
    return "\n\n".join([*parts, *_confusion(what, report.confusion)])


def dataset_table(dataset: Dataset) -> str:
    """Return how much there is of each sign, as text."""
    rows = [[each.label, str(each.takes), str(each.rows), str(each.persons)] for each in summarise(dataset)]
    return table(["sign", "takes", "hands", "persons"], rows)


def teaching_tables(report: TeachingReport) -> str:
    """Return how well signs were learnt, as text."""
    rows = [
        [
            *(sign.summary.label, str(sign.summary.takes), str(sign.summary.rows), str(sign.summary.persons)),
            "as shown" if sign.sided else "either",
            *(_cells(sign.recall) if sign.recall else ["-", "-", "-"]),
        ]
        for sign in report.signs
    ]
    parts = [
        how_it_was_tried(report),
        table(["sign", "takes", "hands", "persons", "hand", "right", "of", "recall"], rows),
        false_hands(report),
        *mistakes(report),
    ]
    return "\n\n".join([*parts, *_confusion("hands", report.confusion)])


def video_tables(report: VideoReport) -> str:
    """Return the figures of a video as text."""
    counted = [[sign, f"{time_s:.1f}"] for sign, time_s in report.counted_s.items()]
    parts = [
        f"{report.frames} frames, {report.duration_s:.1f} s",
        table(["sign that counted", "seconds"], counted),
        f"Times at which a sign began to count that moves the robot: {len(report.motion_events)}, "
        f"{report.motion_events_per_minute:.1f} a minute",
    ]
    if report.labels is None:
        return "\n\n".join([*parts, *_events(report.motion_events), "There are no labels to compare with."])
    return "\n\n".join([*parts, *_labelled(report.labels)])


def _labelled(labels: LabelledFigures) -> list[str]:
    rows = [_frames_row(labels, sign) for sign in labels.counted_right]
    return [
        "By the labels: in how many frames the sign was seen and for how many it counted, and how soon it counted",
        table(["sign", "frames", "seen", "counted", "shown", "missed", "median s", "slowest s"], rows),
        f"False commands: {len(labels.false_commands)} in {labels.scored_s:.1f} s, "
        f"{labels.false_commands_per_minute:.1f} a minute",
        *_events(labels.false_commands),
        *_confusion("frames", labels.confusion),
    ]


def _recall_row(report: PhotoReport, sign: str) -> list[str]:
    sizes = report.recall_by_size[sign]
    by_size = [_rate(sizes[size]) for size in SIZES[:3]]
    return [sign, *_cells(report.recall[sign]), *by_size, str(sizes[SIZES[3]].of), _rate(report.wrong_motion[sign])]


def _frames_row(labels: LabelledFigures, sign: str) -> list[str]:
    counted, reaction = labels.counted_right[sign], labels.reactions[sign]
    frames = [str(counted.of), _rate(labels.seen_right[sign]), _rate(counted)]
    times = [str(reaction.shown), str(reaction.missed), _seconds(reaction.median_s), _seconds(reaction.slowest_s)]
    return [sign, *frames, *times]


def _events(events: Sequence[Event]) -> list[str]:
    rows = [[event.sign, f"{event.start_s:.2f}", f"{event.end_s:.2f}"] for event in events]
    return [table(["sign", "from s", "to s"], rows)] if rows else []


def _confusion(what: str, confusion: Confusion) -> list[str]:
    rows = [
        [label, *(str(count or ".") for count in counts)]
        for label, counts in zip(confusion.labels, confusion.counts, strict=True)
        if any(counts)
    ]
    head = f"Confusion, in {what}: a row for each sign that is shown, a column for each that came out"
    return [head, table(["shown", *confusion.labels], rows)]


def _cells(share: Share) -> list[str]:
    return [str(share.count), str(share.of), _rate(share)]


def _rate(share: Share) -> str:
    return "-" if share.rate is None else f"{share.rate:.1%}"


def _seconds(time_s: float | None) -> str:
    return "-" if time_s is None else f"{time_s:.2f}"
