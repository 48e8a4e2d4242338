"""Tables of results, as text."""

from collections.abc import Iterable, Mapping, Sequence

from handsteer.cli.running import table
from handsteer.plugins.teach.dataset import Dataset, summarise
from handsteer.plugins.teach.evaluation.intervals import Rate, Share
from handsteer.plugins.teach.evaluation.photo_metrics import SIZES, Confusion, PhotoReport, Tally
from handsteer.plugins.teach.evaluation.report import Calibration, Evaluation
from handsteer.plugins.teach.evaluation.sources import PhotoRun
from handsteer.plugins.teach.evaluation.video_metrics import Event, LabelledFigures, VideoReport
from handsteer.plugins.teach.report import TrainingReport, false_hands, how_it_was_tried, mistakes
from handsteer.types import NONE

_PHOTOS_AGAIN = (
    "Each counts once per view, though it shows the same person: intervals over several views are too narrow."
)


def dataset_table(dataset: Dataset) -> str:
    """Return the number of takes, hands and persons of each sign, as text."""
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
    head = f"Confusion, in {what}: a row for each sign shown, a column for each recognised"
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


def evaluation_tables(evaluation: Evaluation, *, with_reliability: bool = False, with_sweep: bool = False) -> str:
    """Return the metrics of ``evaluation`` as text.

    Args:
        evaluation: The results.
        with_reliability: Whether to add the reliability of the likelihoods.
        with_sweep: Whether to add the results for other thresholds.
    """
    parts: list[str] = []
    for what, runs in (("photos", evaluation.photos), ("hands", evaluation.hands)):
        parts += _stills(evaluation, what, runs) if runs else []
    if evaluation.stills:
        parts += _reliability(evaluation.calibration) if with_reliability else []
        parts += _sweep(evaluation) if with_sweep else []
    return "\n\n".join([*parts, *_videos(evaluation)])


def _stills(evaluation: Evaluation, what: str, runs: Sequence[PhotoRun]) -> list[str]:
    views, sources = (list(dict.fromkeys(names)) for names in ([r.view.name for r in runs], [r.source for r in runs]))
    together = evaluation.of_photos(runs)
    parts = []
    if len(views) > 1:
        rows = {view: evaluation.of_photos([run for run in runs if run.view.name == view]) for view in views}
        parts += [f"Recall and unintended motion, by how the {what} are seen", _comparison("view", rows)]
    if len(sources) > 1:
        by_source = {name: evaluation.of_photos([run for run in runs if run.source == name]) for name in sources}
        parts += [
            "Recall and unintended motion, by source",
            _comparison("source", {**by_source, "all": together}),
        ]
    parts += [f"{', '.join(sources)}: {_counted(together, what)}"]
    parts += [f"In {len(views)} views. {_PHOTOS_AGAIN}"] if len(views) > 1 else []
    return [*parts, *_photo_tables(together, what)]


def _counted(report: PhotoReport, what: str) -> str:
    text = f"{report.photos} {what}, {report.unscored} not scored"
    return f"{text}; {report.without_depth} more not scored: no depth" if report.without_depth else text


def _photo_tables(report: PhotoReport, what: str) -> list[str]:
    recall = [
        [
            sign,
            *cells(share),
            str(share.of - report.recall_of_found[sign].of),
            rate(report.recall_of_found[sign]),
            rate(report.wrong_motion[sign]),
        ]
        for sign, share in report.recall.items()
    ]
    sizes = [[sign, *(rate(shares[size]) for size in SIZES[:3])] for sign, shares in report.recall_by_size.items()]
    parts = [
        f"Recall with its 95 % interval; hands not found (they count as wrong), and recall of the found ones;\n"
        f"and the {what} recognised as another sign that moves the robot",
        table(["sign", "right", "of", "recall", "no hand", "of the found", "moves"], recall),
        "Recall by the longer side of the hand that was found",
        table(["sign", *SIZES[:3]], sizes),
    ]
    if report.by_person_set:
        parts += [
            "Recall and unintended motion, by who shows it (person_set)",
            _comparison("person_set", report.by_person_set),
        ]
    if report.false_commands.of:
        kinds = {**report.false_commands_by_kind, "all": report.false_commands}
        parts += [
            f"False commands: {what} of no sign that were recognised as one that moves the robot",
            table(["kind", "false", "of", "rate"], [[kind or "(no kind)", *cells(kinds[kind])] for kind in kinds]),
        ]
    return [*parts, *confusion_table(what, report.confusion)]


def _comparison(what: str, rows: Mapping[str, Tally]) -> str:
    """Return a row for each tally: recall of each sign, false commands, and other signs that move the robot."""
    signs = list(dict.fromkeys(sign for row in rows.values() for sign in row.recall if sign != NONE))
    lines = [
        [
            name or f"(no {what})",
            str(row.photos),
            *(rate(row.recall[sign]) if sign in row.recall else "-" for sign in signs),
            rate(row.false_commands),
            rate(row.wrong_motion_of_signs),
        ]
        for name, row in rows.items()
    ]
    return table([what, "of", *signs, "NONE moves", "other moves"], lines)


def _reliability(figures: Calibration) -> list[str]:
    rows = [
        [
            f"{each.low:.1f} to {each.high:.1f}",
            str(each.right.of),
            "-" if each.confidence is None else f"{each.confidence:.3f}",
            rate(each.right),
        ]
        for each in figures.bins
    ]
    error = "-" if figures.expected_error is None else f"{figures.expected_error:.1%}"
    return [
        f"Reliability: the likelihood of the likeliest sign, and how often that sign is shown.\n"
        f"Expected calibration error: {error}",
        table(["likelihood", "hands", "mean", "shown"], rows),
    ]


def _sweep(evaluation: Evaluation) -> list[str]:
    rows = evaluation.sweep
    alarms = [
        [f"{threshold:.2f}", *(rate(row.false_alarms[sign]) for sign in evaluation.signs)]
        for threshold, row in rows.items()
    ]
    return [
        "Thresholds: recall and unintended motion if a sign were recognised from this likelihood on",
        _comparison("threshold", {f"{threshold:.2f}": row for threshold, row in rows.items()}),
        "False alarms: the share of pictures without the sign in which it was recognised",
        table(["threshold", *evaluation.signs], alarms),
    ]


def _videos(evaluation: Evaluation) -> list[str]:
    runs = evaluation.videos
    several_views = len({run.view for run in runs}) > 1
    reports = {
        f"{run.source}, {run.view.name}" if several_views else run.source: evaluation.of_videos([run]) for run in runs
    }
    if len(runs) < 2:
        return [part for name, report in reports.items() for part in _video_tables(name, report)]
    together = {**reports, "all": evaluation.of_videos(runs)}
    parts = [
        "Per minute, with its 95 % interval: onsets of signs that move the robot, and false commands",
        table(["video", "s", "motion", "per minute", "labelled s", "false", "per minute"], _rates(together.items())),
    ]
    return [*parts, *(part for name, report in reports.items() for part in _video_tables(name, report))]


def _rates(reports: Iterable[tuple[str, VideoReport]]) -> list[list[str]]:
    return [
        [
            name,
            f"{report.duration_s:.1f}",
            str(len(report.motion_events)),
            _per_minute(report.motion_rate),
            *(
                [
                    f"{report.labels.scored_s:.1f}",
                    str(len(report.labels.false_commands)),
                    _per_minute(report.labels.false_rate),
                ]
                if report.labels
                else ["-", "-", "-"]
            ),
        ]
        for name, report in reports
    ]


def _video_tables(name: str, report: VideoReport) -> list[str]:
    parts = [
        f"{name}: {report.frames} frames, {report.duration_s:.1f} s",
        table(["sign that counted", "seconds"], [[sign, f"{time_s:.1f}"] for sign, time_s in report.counted_s.items()]),
        f"Onsets of signs that move the robot: {len(report.motion_events)}, "
        f"{_per_minute(report.motion_rate, ' per minute')}; with control.engage: {len(report.engaged_motion)}",
        f"After another sign {_per_minute(report.after_sign_rate, ' per minute')} of the time with a sign, "
        f"after none {_per_minute(report.after_none_rate, ' per minute')} of the time without one",
    ]
    if report.labels is None:
        return [*parts, *_events(report.motion_events), "No labels to compare with."]
    return [*parts, *_labelled(report.labels)]


def _labelled(labels: LabelledFigures) -> list[str]:
    rows = [_frames_row(labels, sign) for sign in labels.counted_right]
    return [
        "By the labels: frames in which the sign was seen and in which it counted, and its reaction time",
        table(["sign", "frames", "seen", "counted", "shown", "missed", "median s", "slowest s"], rows),
        f"False commands: {len(labels.false_commands)} in {labels.scored_s:.1f} s, "
        f"{_per_minute(labels.false_rate, ' per minute')}; with control.engage: {len(labels.engaged_false)}",
        *_events(labels.false_commands),
        *confusion_table("frames", labels.confusion),
    ]


def _frames_row(labels: LabelledFigures, sign: str) -> list[str]:
    counted, reaction = labels.counted_right[sign], labels.reactions[sign]
    frames = [str(counted.of), rate(labels.seen_right[sign]), rate(counted)]
    times = [str(reaction.shown), str(reaction.missed), _seconds(reaction.median_s), _seconds(reaction.slowest_s)]
    return [sign, *frames, *times]


def _events(events: Sequence[Event]) -> list[str]:
    rows = [[event.sign, f"{event.start_s:.2f}", f"{event.end_s:.2f}"] for event in events]
    return [table(["sign", "from s", "to s"], rows)] if rows else []


def _per_minute(events: Rate, unit: str = "") -> str:
    if events.interval is None:
        return "-"
    low, high = events.interval
    return f"{events.per_minute:.1f}{unit} ({low:.1f}-{high:.1f})"


def _seconds(time_s: float | None) -> str:
    return "-" if time_s is None else f"{time_s:.2f}"
