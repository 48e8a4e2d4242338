import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.plugins.teach.evaluation.video_metrics import Event, FrameVerdict, VideoReport, video_report
from handsteer.types import FORWARD, GO, MOTION_SIGNS, NONE, SIGNS, STOP

LETTERS = {"F": FORWARD, "S": STOP, "G": GO, ".": NONE, "?": None}
FPS = 10


def frames_of(truth: str, counts: str, fps: float = FPS) -> list[FrameVerdict]:
    """Return the frames of a video, one letter a frame."""
    return [
        FrameVerdict(at / fps, LETTERS[true], LETTERS[counted] or NONE, LETTERS[counted] or NONE)
        for at, (true, counted) in enumerate(zip(truth, counts, strict=True))
    ]


def report(truth: str, counts: str, grace_s: float = 0.25) -> VideoReport:
    """Return the figures of a video of 10 frames a second."""
    frames = frames_of(truth, counts)
    return video_report({"v": frames}, SIGNS, MOTION_SIGNS, grace_s)


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
    assert labels.false_commands == tuple(Event(FORWARD, *times, "v") for times in false)
    assert labels.false_rate.per_minute == pytest.approx(len(false) * 60 / labels.scored_s)


def test_without_grace_each_frame_beyond_is_false() -> None:
    labels = report("FF..", "FFF.", grace_s=0.0).labels
    assert labels is not None
    assert labels.false_commands == (Event(FORWARD, 0.2, 0.2, "v"),)


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
    assert figures.motion_events == (Event(FORWARD, 0.2, 0.3, "v"), Event(FORWARD, 0.5, 0.6, "v"))
    assert figures.motion_rate.per_minute == pytest.approx(120)
    assert json.loads(json.dumps(figures.as_dict()))["labels"] is None


def test_motion_behind_a_sign_and_behind_none_are_told_apart() -> None:
    figures = report("?" * 12, "..FF.GFF....")
    assert [event.follows_sign for event in figures.motion_events] == [False, True]
    assert figures.after_sign_rate.per_minute == pytest.approx(60 / 0.5)
    assert figures.after_none_rate.per_minute == pytest.approx(60 / 0.7)


def test_with_the_clutch_only_what_follows_a_held_palm_counts() -> None:
    truth, counts = "S" * 30 + "." * 10 + "." * 80, "FF..." + "S" * 12 + "FFF.........." + "F" * 10 + "." * 79 + "F"
    figures = report(truth, counts)
    assert [event.start_s for event in figures.motion_events] == [0.0, 1.7, 3.0, 11.9]
    assert [event.start_s for event in figures.engaged_motion] == [1.7, 3.0]
    assert figures.labels is not None
    assert len(figures.labels.engaged_false) == len(figures.labels.false_commands) - 2


@pytest.mark.parametrize("frames", ["", "F"])
def test_next_to_nothing(frames: str) -> None:
    assert report(frames, frames).motion_rate.per_minute == 0.0


@given(text=st.text(alphabet="FSG.", max_size=40))
def test_a_recogniser_that_is_always_right_makes_no_false_command(text: str) -> None:
    labels = report(text, text, grace_s=0.0).labels
    assert (labels is None) == (not text)
    if labels:
        assert labels.false_commands == ()
        assert all(reaction.slowest_s == 0.0 for reaction in labels.reactions.values())
        assert all(share.rate == 1.0 for share in labels.counted_right.values())


def test_several_videos_are_summed() -> None:
    videos = {
        "a": frames_of("FFFF......", "..FF...F.."),
        "b": frames_of("??????????????????????????????", ".........................FFFF.", fps=2 * FPS),
        "c": frames_of("FF........", "F........."),
    }
    figures = video_report(videos, SIGNS, MOTION_SIGNS, grace_s=0.2)
    assert (figures.videos, figures.frames) == (3, 50)
    assert figures.duration_s == pytest.approx(1.0 + 1.5 + 1.0)
    assert figures.counted_s[FORWARD] == pytest.approx(0.3 + 0.2 + 0.1)
    assert [event.video for event in figures.motion_events] == ["a", "a", "b", "c"]
    assert figures.motion_rate.per_minute == pytest.approx(60 * 4 / 3.5)
    labels = figures.labels
    assert labels is not None
    assert labels.scored_s == pytest.approx(2.0)
    assert labels.false_commands == (Event(FORWARD, 0.7, 0.7, "a"),)
    assert (labels.reactions[FORWARD].shown, labels.reactions[FORWARD].slowest_s) == (2, 0.2)
    assert labels.counted_right[FORWARD] == Share(3, 6)
    plain = json.loads(json.dumps(figures.as_dict(), allow_nan=False))
    assert plain["motion_events_per_minute_low"] < plain["motion_events_per_minute"]
    assert plain["labels"]["false_commands_per_minute_high"] > 30
