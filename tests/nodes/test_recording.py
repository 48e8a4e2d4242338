import itertools

import pytest

from handsteer.config import Recorded
from handsteer.nodes.recording import Recording, in_words

LIMIT_S = 0.35
DAYS_S = 3 * 86_400.0


def followed(
    recording: Recording, ages_s: list[float], period_s: float = 0.1, *, by_player: bool = False
) -> list[bool]:
    """Return which frames of these ages are followed; they come at a steady rate."""
    times_s = itertools.count(1_000_000.0, period_s)
    return [
        recording.follows(now_s, now_s - age_s, by_player=by_player)
        for now_s, age_s in zip(times_s, ages_s, strict=False)
    ]


@pytest.mark.parametrize("age_s", [1.0, DAYS_S, 3e8])
def test_what_a_player_sends_is_followed_from_the_first_frame_on(age_s: float) -> None:
    assert all(followed(Recording("auto", LIMIT_S), [age_s] * 5, by_player=True))


def test_a_recording_may_be_paused_looped_and_slowed() -> None:
    ages_s = [50.0, 50.0, 61.0, 61.0, 30.0, 30.0, 30.05, 30.1, 30.15]
    assert all(followed(Recording("auto", LIMIT_S), ages_s, by_player=True))


@pytest.mark.parametrize("recorded", ["auto", "never"])
@pytest.mark.parametrize("age_s", [0.0, 1.0, DAYS_S])
def test_no_other_frame_is_followed_by_itself(recorded: Recorded, age_s: float) -> None:
    assert not any(followed(Recording(recorded, LIMIT_S), [age_s] * 30))


def test_nothing_is_followed_when_it_is_switched_off() -> None:
    assert not any(followed(Recording("never", LIMIT_S), [DAYS_S] * 5, by_player=True))


def test_when_asked_for_what_is_older_than_any_link_delays_is_followed() -> None:
    assert all(followed(Recording("always", LIMIT_S), [DAYS_S] * 5))
    assert not any(followed(Recording("always", LIMIT_S), [0.0, 0.2, 1.0, 3.0, 4.9]))


@pytest.mark.parametrize("by_player", [True, False])
def test_a_stamp_that_stands_still_is_not_followed(by_player: bool) -> None:
    recording = Recording("always", LIMIT_S)
    stood = [recording.follows(now_s, 10.0, by_player=by_player) for now_s in (100.0, 100.1, 100.2)]
    assert stood == [True, False, False]


def test_the_hint_waits_until_frames_have_come_in_step(caplog: pytest.LogCaptureFixture) -> None:
    recording = Recording("auto", LIMIT_S)
    hints = []
    for number in range(20):
        now_s = 100.0 + number / 10
        recording.follows(now_s, now_s - DAYS_S, by_player=False)
        hints.append(recording.hint(now_s))
    assert hints[:10] == [None] * 10
    assert all(hint is not None and "set the parameter recorded to always" in hint for hint in hints[11:])
    assert len(caplog.messages) == 1


@pytest.mark.parametrize("step_s", [0.5, -0.5])
def test_frames_of_a_link_that_gets_slower_or_catches_up_are_no_recording(step_s: float) -> None:
    recording = Recording("auto", LIMIT_S)
    for number in range(40):
        now_s = 1000.0 + number / 10
        recording.follows(now_s, now_s - 60.0 - number * step_s, by_player=False)
        assert recording.hint(now_s) is None


def test_frames_that_come_a_little_late_are_no_recording() -> None:
    recording = Recording("auto", LIMIT_S)
    followed(recording, [3.0] * 40)
    assert recording.hint(1_000_004.0) is None


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(7.4, "7 s"), (600.0, "10 minutes"), (8000.0, "2 hours"), (DAYS_S, "3 days"), (1e9, "32 years")],
)
def test_durations_in_words(seconds: float, words: str) -> None:
    assert in_words(seconds) == words
