import math
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.clock import RealClock
from handsteer.config import Config, VirtualHandConfig
from handsteer.errors import CameraNotFound, DatasetError
from handsteer.plugins.teach.collect import (
    Collector,
    Facts,
    Status,
    collect_live,
    collect_moment,
    collect_recorded,
    largest,
)
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.recognition.recognizer import open_landmarker
from tests.recognition.hands import moved, show_sign

FACTS = Facts("Hi", "me", "today", "test")
HAND = show_sign("Stop")


def run(collector: Collector, seconds: float, *, held: bool = False, hand: bool = True) -> list[Status]:
    return [
        collector.step(HAND if hand else None, 0.1, key_age_s=0.0 if held else math.inf)
        for _ in range(round(seconds / 0.1))
    ]


def test_a_countdown_goes_before_each_take() -> None:
    collector = Collector(FACTS, takes=2, take_s=1.0, countdown_s=2.0)
    phases = [status.phase for status in run(collector, 6.4)]
    assert phases[:19] == ["countdown"] * 19
    assert phases.count("recording") == pytest.approx(22, abs=2)
    assert collector.done
    assert collector.step(HAND, 0.1).phase == "done"


def test_a_take_has_the_hands_and_their_times() -> None:
    collector = Collector(FACTS, takes=1, take_s=1.0, countdown_s=0.5)
    take = next(status.finished for status in run(collector, 3.0) if status.finished)
    assert (take.label, take.person, take.session, take.source) == ("Hi", "me", "today", "test")
    assert len(take.hands) == pytest.approx(11, abs=1)
    assert take.times_s[0] == 0.0
    assert np.diff(take.times_s) == pytest.approx(0.1)


def test_a_take_lasts_for_as_long_as_the_key_is_held() -> None:
    collector = Collector(FACTS, takes=2, take_s=1.0, countdown_s=1.0, hold=True)
    assert {status.phase for status in run(collector, 5.0)} == {"ready"}
    assert {status.phase for status in run(collector, 2.0, held=True)} == {"recording"}
    ages_s = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.71]
    after = [collector.step(HAND, 0.1, key_age_s=age_s) for age_s in ages_s]
    assert [status.phase for status in after] == [*["recording"] * 6, "ready"]
    take = after[-1].finished
    assert take is not None
    assert len(take.hands) == pytest.approx(20, abs=1)  # what came after the key was let go is left out
    assert not collector.done


def test_a_take_without_enough_hands_is_done_again() -> None:
    collector = Collector(FACTS, takes=1, take_s=1.0, countdown_s=0.5)
    statuses = run(collector, 2.0, hand=False)
    assert [status.failed for status in statuses].count(True) == 1
    assert not collector.done
    assert any(status.finished for status in run(collector, 3.0))


def test_a_take_that_was_undone_is_collected_again() -> None:
    collector = Collector(FACTS, takes=1, take_s=0.5, countdown_s=0.1)
    run(collector, 2.0)
    assert collector.done
    collector.again()
    assert any(status.finished for status in run(collector, 2.0))


@given(st.lists(st.tuples(st.floats(0, 2), st.booleans(), st.booleans()), max_size=60), st.booleans())
def test_it_never_gives_more_takes_than_asked_for(frames: list[tuple[float, bool, bool]], hold: bool) -> None:
    collector = Collector(FACTS, takes=2, take_s=0.5, countdown_s=0.5, hold=hold)
    statuses = [collector.step(HAND if seen else None, dt, key_age_s=0.0 if held else 1.0) for dt, seen, held in frames]
    finished = [status.finished for status in statuses if status.finished]
    assert len(finished) <= 2
    assert all(len(take.hands) == len(take.times_s) >= 5 for take in finished)


def test_the_largest_hand_counts() -> None:
    small, large = moved(HAND, 100, scale=0.5), moved(HAND, -100, scale=0.8)
    assert largest([small, large]) is large
    assert largest([]) is None


@pytest.mark.slow
def test_a_camera_gives_takes_live() -> None:
    clock = RealClock()
    camera = VirtualHandCamera(VirtualHandConfig(script="Peace:9"), width=320, height=240, fps=30, clock=clock)
    seen: list[Status] = []
    collector = Collector(FACTS, takes=2, take_s=1.0, countdown_s=0.2)
    takes = list(
        collect_live(
            camera, open_landmarker(Config()), collector, clock, show=lambda _image, _hand, status: seen.append(status)
        )
    )
    assert len(takes) == 2
    assert all(len(take.hands) >= 5 for take in takes)
    assert {status.phase for status in seen} >= {"countdown", "recording"}


@pytest.fixture(scope="module")
def pictures() -> list[np.ndarray]:
    def frames() -> Iterator[np.ndarray]:
        camera = VirtualHandCamera(
            VirtualHandConfig(script="Peace:9"), width=320, height=240, fps=30, clock=RealClock()
        )
        for _ in range(8):
            yield camera.read().image

    return list(frames())


@pytest.mark.slow
def test_a_video_is_cut_into_takes(tmp_path: Path, pictures: list[np.ndarray]) -> None:
    path = tmp_path / "peace.mp4"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 8.0, (320, 240))
    for picture in pictures * 3:
        writer.write(picture)
    writer.release()
    takes = collect_recorded(path, open_landmarker(Config()), FACTS, take_s=1.0)
    assert [len(take.hands) for take in takes] == [8, 8, 8]
    assert takes[1].times_s[0] == 0.0


@pytest.mark.slow
def test_each_photo_is_a_take(tmp_path: Path, pictures: list[np.ndarray]) -> None:
    (tmp_path / "far").mkdir()
    for name, picture in (("1.png", pictures[0]), ("far/2.png", pictures[1]), ("far/3.png", pictures[0] * 0)):
        cv2.imwrite(str(tmp_path / name), picture)
    takes = collect_recorded(tmp_path, open_landmarker(Config()), FACTS, take_s=1.0)
    assert [(len(take.hands), take.session) for take in takes] == [(1, "today"), (1, "today/far")]


@pytest.mark.slow
def test_recordings_without_a_hand_are_refused(tmp_path: Path, pictures: list[np.ndarray]) -> None:
    landmarker = open_landmarker(Config())
    cv2.imwrite(str(tmp_path / "empty.png"), pictures[0] * 0)
    with pytest.raises(DatasetError, match="no hand was found in it"):
        collect_recorded(tmp_path, landmarker, FACTS, 1.0)
    with pytest.raises(CameraNotFound):
        collect_recorded(tmp_path / "gone.mp4", landmarker, FACTS, 1.0)


@pytest.mark.slow
def test_a_moment_of_a_recording_becomes_a_take(recording: Path) -> None:
    landmarker = open_landmarker(Config())
    take = collect_moment(recording, landmarker, FACTS, 1.5, 2.0)
    assert 10 <= len(take.hands) <= 17
    assert take.times_s[0] == 0.0
    assert take.times_s[-1] <= 0.5
    with pytest.raises(DatasetError, match="no hand from 100 to 101 s"):
        collect_moment(recording, landmarker, FACTS, 100.0, 101.0)


@pytest.mark.slow
def test_a_whole_recording_becomes_takes(recording: Path) -> None:
    takes = collect_recorded(recording, open_landmarker(Config()), FACTS, 2.0)
    assert 3 <= len(takes) <= 4
