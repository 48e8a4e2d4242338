import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.signs.figures import Share
from handsteer.signs.video_figures import Event, FrameVerdict, VideoReport, video_report
from handsteer.signs.vocabulary import FORWARD, GO, MOTION_SIGNS, NONE, SIGNS, STOP

LETTERS = {"F": FORWARD, "S": STOP, "G": GO, ".": NONE, "?": None}
FPS = 10


def report(truth: str, counts: str, grace_s: float = 0.25) -> VideoReport:
    """Return the figures of a video of 10 frames a second, one letter a frame."""
    frames = [
        FrameVerdict(at / FPS, LETTERS[true], LETTERS[counted] or NONE, LETTERS[counted] or NONE)
        for at, (true, counted) in enumerate(zip(truth, counts, strict=True))
    ]
    return video_report(frames, SIGNS, MOTION_SIGNS, grace_s)


@pytest.mark.parametrize(
    ("truth", "counts", "false"),
    [
        ("..........", "...FF..F..", [(0.3, 0.4), (0.7, 0.7)]),
        ("FFFFF.....", "..FFFFF...", []),  # it ends within the time to react
        ("FFFFF.....", "..FFFFFFFF", [(0.8, 0.9)]),  # it goes on for too long
        ("FFFFF.....", ".......F..", []),  # it comes late, but what was shown last was Forward
        ("?????.....", "..FFFFF...", []),  # nobody knows what was shown
        ("FFFFFSSSSS", "FFFFFSSFSS", []),
        ("FFFFFSSSSS", "FFFFFSSSSF", [(0.9, 0.9)]),
        ("..........", "SSGGGSSSGG", []),  # no motion
    ],
)
def test_false_commands(truth: str, counts: str, false: list[tuple[float, float]]) -> None:
    labels = report(truth, counts).labels
    assert labels is not None
    assert labels.false_commands == tuple(Event(FORWARD, *times) for times in false)
    assert labels.false_commands_per_minute == pytest.approx(len(false) * 60 / labels.scored_s)


def test_without_grace_each_frame_beyond_is_false() -> None:
    labels = report("FF..", "FFF.", grace_s=0.0).labels
    assert labels is not None
    assert labels.false_commands == (Event(FORWARD, 0.2, 0.2),)


def test_reaction_times() -> None:
    labels = report("FFFF..FFFF..FFFF", "..FF..F.........").labels
    assert labels is not None
    forward = labels.reactions[FORWARD]
    assert (forward.shown, forward.missed) == (3, 1)
    assert forward.median_s == pytest.approx(0.1)
    assert forward.slowest_s == pytest.approx(0.2)
    assert labels.counted_right[FORWARD] == Share(3, 12)
    missed = report("FFFF", "....").labels
    assert missed is not None
    assert missed.reactions[FORWARD].median_s is None
    assert "null" in json.dumps(missed.as_dict(), allow_nan=False)


def test_without_labels_signs_and_motion_are_counted() -> None:
    figures = report("?" * 10, "..FF.FF.SS")
    assert figures.labels is None
    assert figures.counted_s == {STOP: 0.2, FORWARD: 0.4, NONE: 0.4}
    assert figures.motion_events == (Event(FORWARD, 0.2, 0.3), Event(FORWARD, 0.5, 0.6))
    assert figures.motion_events_per_minute == pytest.approx(120)
    assert json.loads(json.dumps(figures.as_dict()))["labels"] is None


@pytest.mark.parametrize("frames", ["", "F"])
def test_next_to_nothing(frames: str) -> None:
    assert report(frames, frames).motion_events_per_minute == 0.0


@given(text=st.text(alphabet="FSG.", max_size=40))
def test_a_recogniser_that_is_always_right_makes_no_false_command(text: str) -> None:
    labels = report(text, text, grace_s=0.0).labels
    assert (labels is None) == (not text)
    if labels:
        assert labels.false_commands == ()
        assert all(reaction.slowest_s == 0.0 for reaction in labels.reactions.values())
        assert all(share.rate == 1.0 for share in labels.counted_right.values())
