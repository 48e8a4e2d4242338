import itertools
from itertools import accumulate

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import Recorded
from handsteer.messages import Time
from handsteer.nodes.timing import FrameAge, PlayedTime, Recording, StallGuard, duration_in_words
from handsteer.timeouts import BURST_S, DISTRUST_S


def test_what_comes_soon_after_an_interruption_is_distrusted() -> None:
    interruption = StallGuard(0.35, 0.0)
    assert not interruption.note(0.3)
    assert not interruption.distrusts(0.3)
    assert interruption.note(1.0)
    assert interruption.distrusts(1.0)
    assert interruption.distrusts(1.0 + DISTRUST_S / 2)
    assert not interruption.distrusts(1.0 + DISTRUST_S)


def test_a_burst_is_distrusted_to_its_end_however_long_it_takes() -> None:
    interruption = StallGuard(0.35, 0.0)
    interruption.note(1.0)
    now_s = 1.0
    while now_s < 1.0 + 5 * DISTRUST_S:
        assert interruption.distrusts(now_s)
        now_s += BURST_S / 2
    now_s += BURST_S
    assert not interruption.distrusts(now_s)
    assert not interruption.distrusts(now_s + BURST_S / 2)  # as fast as it may be, it is not a backlog


def test_what_comes_fast_without_an_interruption_is_trusted() -> None:
    interruption = StallGuard(0.35, 0.0)
    for number in range(1000):
        interruption.note(number / 1000)
        assert not interruption.distrusts(number / 1000)


LIMIT_S = 0.35
TINY_S = 1e-6
PERIOD_S = 1 / 30
LEAK_S = 60 * PERIOD_S * 0.001


def in_order(delays_s: list[float]) -> list[float]:
    """Return delays of frames that come every 33 ms in the order in which they were sent."""
    return list(accumulate(delays_s, lambda last, delay_s: min(delay_s, last + PERIOD_S)))


DELAYS_S = st.lists(st.floats(0.0, 2.0), min_size=1, max_size=60).map(in_order)


def ages(delays_s: list[float], ahead_s: float) -> list[tuple[float, str | None]]:
    """Let a frame come every 33 ms with the given delays, stamped by a clock that is ahead of ours."""
    age = FrameAge(LIMIT_S)
    told = []
    for number, delay_s in enumerate(delays_s):
        now_s = 1000.0 + number * PERIOD_S
        why = age.why_refused(now_s, now_s - delay_s + ahead_s)
        told.append((age.age_s, why))
    return told


@given(DELAYS_S, st.floats(0.0, LIMIT_S - 0.01))
def test_a_frame_is_never_taken_to_be_older_than_it_is(delays_s: list[float], ahead_s: float) -> None:
    for delay_s, (age_s, why) in zip(delays_s, ages(delays_s, ahead_s), strict=True):
        assert age_s <= delay_s + TINY_S
        assert why is None or delay_s > LIMIT_S - TINY_S


@given(DELAYS_S, st.floats(0.0, LIMIT_S - 0.01))
def test_a_frame_that_is_used_is_too_old_by_no_more_than_the_shortest_delay(
    delays_s: list[float], ahead_s: float
) -> None:
    shortest_s = float("inf")
    for delay_s, (_, why) in zip(delays_s, ages(delays_s, ahead_s), strict=True):
        shortest_s = min(shortest_s, delay_s)
        assert why is not None or delay_s <= LIMIT_S + shortest_s + LEAK_S + TINY_S


@given(DELAYS_S, st.floats(0.0, 10.0))
def test_of_a_clock_that_is_behind_too_few_frames_are_used_never_too_many(
    delays_s: list[float], behind_s: float
) -> None:
    for delay_s, (_, why) in zip(delays_s, ages(delays_s, -behind_s), strict=True):
        assert (why is None) == (delay_s + behind_s <= LIMIT_S) or abs(delay_s + behind_s - LIMIT_S) < TINY_S


@pytest.mark.parametrize("ahead_s", [0.4, 2.0, 3600.0])
def test_a_clock_that_is_far_ahead_is_refused_in_words(ahead_s: float) -> None:
    ((_, why),) = ages([0.0], ahead_s)
    assert why == f"frames are stamped {ahead_s:.1f} s ahead of our clock: are the clocks of the machines synchronised?"


def test_an_old_frame_of_this_machine_is_not_blamed_on_clocks() -> None:
    age = FrameAge(LIMIT_S, one_clock=True)
    assert age.why_refused(0.5, 0.0) == "This computer is too slow or busy: pictures arrive 0.5 s late"


def test_an_old_frame_is_told_though_its_clock_is_ahead() -> None:
    (_, (_, why)) = ages([0.02, 0.42], 0.3)
    assert why is not None
    assert why.startswith("frames come 0.4 s after their stamp by a clock that is 0.3 s ahead of ours")


def test_a_clock_that_is_set_right_is_trusted_again() -> None:
    age = FrameAge(LIMIT_S)
    assert age.why_refused(0.0, 0.34) is None
    assert age.why_refused(1.0, 0.95) is not None
    for number in range(6000):
        now_s = 1.0 + number * PERIOD_S
        why = age.why_refused(now_s, now_s - 0.05)
    assert why is None
    assert age.ahead_s < 0.25


@pytest.mark.parametrize("set_by_s", [5.0, -5.0, 3600.0])
def test_a_clock_that_is_set_while_frames_come_is_followed_after_a_second(set_by_s: float) -> None:
    age = FrameAge(LIMIT_S)
    told = []
    for number in range(300):
        now_s = 1000.0 + number * PERIOD_S
        captured_s = now_s - 0.03 - 0.01 * (number % 3)
        told.append(age.why_refused(now_s, captured_s - (set_by_s if number >= 90 else 0.0)))
    assert set(told[:90]) == {None}
    way = "back" if set_by_s > 0 else "ahead"
    assert told[91] is not None
    assert told[91].startswith(f"a clock was set {way} by {abs(set_by_s):.1f} s: frames are timed again")
    assert set(told[121:]) == {None}


def test_a_few_old_frames_with_a_long_pause_between_are_no_clock_that_was_set(caplog: pytest.LogCaptureFixture) -> None:
    age = FrameAge(LIMIT_S)
    assert all(age.why_refused(number * PERIOD_S, number * PERIOD_S) is None for number in range(30))
    for began_s in (10.0, 20.0, 30.0):
        for number in range(10):
            now_s = began_s + number * PERIOD_S
            assert age.why_refused(now_s, now_s - 3600.0) is not None
    assert "corrected" not in caplog.text
    told = [age.why_refused(40.0 + number * PERIOD_S, number * PERIOD_S - 3560.0) for number in range(40)]
    assert told[-1] is None
    assert "a clock was set back by 3600.0 s: the stamps of its messages are corrected by that" in caplog.text


def test_a_pause_while_a_clock_that_was_set_is_measured_begins_that_again() -> None:
    age = FrameAge(LIMIT_S)
    assert all(age.why_refused(number * PERIOD_S, number * PERIOD_S) is None for number in range(30))
    for began_s, frames in ((1.0, 10), (6.0, 60)):
        told = [age.why_refused(began_s + n * PERIOD_S, began_s + n * PERIOD_S - 5.0) for n in range(frames)]
    assert told[-1] is None


def test_a_queue_that_stood_still_is_no_clock_that_was_set() -> None:
    age = FrameAge(LIMIT_S)
    assert all(age.why_refused(number * PERIOD_S, number * PERIOD_S) is None for number in range(30))
    late = [age.why_refused(6.0 + number * PERIOD_S, 1.0 + number * PERIOD_S) for number in range(300)]
    assert all(why is not None and why.startswith("frames come 5.0 s after their stamp") for why in late)


def test_a_wrong_stamp_is_not_compared_with_another_wrong_one() -> None:
    """After two, 3 and 8 s ahead, a good frame looked like one of a clock that was set back by 8 s."""
    age = FrameAge(LIMIT_S)
    for number in range(60):
        now_s = 1000.0 + number * PERIOD_S
        why = age.why_refused(now_s, now_s - {30: -3.0, 31: -8.0}.get(number, 0.01))
        assert (why is None) == (number not in (30, 31))
    assert age.why_refused(1010.0, 1002.0) is not None


def test_a_stamp_that_is_a_second_ahead_makes_the_next_ones_not_late() -> None:
    """One of a second ahead, then one of 0.25 s late: they looked like a clock that was set, and no frame counted."""
    age = FrameAge(LIMIT_S)
    delays_s = [0.01] * 30 + [-1.0, 0.25] + [0.01] * 60
    told = [age.why_refused(number * PERIOD_S, number * PERIOD_S - delay_s) for number, delay_s in enumerate(delays_s)]
    assert [number for number, why in enumerate(told) if why is not None] == [30]


ODD_S = st.lists(st.floats(-100.0, 100.0), min_size=1, max_size=10)


@given(ODD_S)
def test_after_frames_with_odd_stamps_good_ones_count_soon_and_old_ones_never(odd_s: list[float]) -> None:
    """The odd ones may be what a broken driver or a hostile publisher sends between those of the camera."""
    age = FrameAge(LIMIT_S)
    delays_s = [0.01] * 30 + odd_s + [0.01] * 60
    told = [
        (delay_s, age.why_refused(1000.0 + number * PERIOD_S, 1000.0 + number * PERIOD_S - delay_s))
        for number, delay_s in enumerate(delays_s)
    ]
    assert told[-1][1] is None
    assert all(why is not None for delay_s, why in told if delay_s > 2 * LIMIT_S)
    late = age.why_refused(1020.0, 1012.0)
    assert late is not None


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


@pytest.mark.parametrize("age_s", [0.0, 1.0, DAYS_S, 3e8])
def test_what_a_player_sends_is_followed_from_the_first_frame_on(age_s: float) -> None:
    assert all(followed(Recording("auto"), [age_s] * 5, by_player=True))


def test_a_recording_may_be_paused_looped_and_slowed() -> None:
    ages_s = [50.0, 50.0, 61.0, 61.0, 30.0, 30.0, 30.05, 30.1, 30.15]
    assert all(followed(Recording("auto"), ages_s, by_player=True))


@pytest.mark.parametrize("recorded", ["auto", "never"])
@pytest.mark.parametrize("age_s", [0.0, 1.0, DAYS_S])
def test_no_other_frame_is_followed_by_itself(recorded: Recorded, age_s: float) -> None:
    assert not any(followed(Recording(recorded), [age_s] * 30))


def test_nothing_is_followed_when_it_is_switched_off() -> None:
    assert not any(followed(Recording("never"), [DAYS_S] * 5, by_player=True))


def test_when_asked_for_what_is_older_than_any_link_delays_is_followed() -> None:
    assert all(followed(Recording("always"), [DAYS_S] * 5))
    assert not any(followed(Recording("always"), [0.0, 0.2, 1.0, 3.0, 4.9]))


@pytest.mark.parametrize("by_player", [True, False])
def test_a_stamp_that_stands_still_is_not_followed(by_player: bool) -> None:
    recording = Recording("always")
    stood = [recording.follows(now_s, 10.0, by_player=by_player) for now_s in (100.0, 100.1, 100.2)]
    assert stood == [True, False, False]


def stamp(ms: int) -> Time:
    return Time(sec=ms // 1000, nanosec=ms % 1000 * 10**6)


def test_played_time_is_that_of_the_stamps_and_begins_anew_where_they_go_back() -> None:
    played = PlayedTime(LIMIT_S)
    assert [played.since_last(stamp(ms)) for ms in (5000, 5100, 5300, 5000, 5100)] == [None, 0.1, 0.2, None, 0.1]
    played.end()
    assert played.since_last(stamp(5200)) is None, "a camera was seen meanwhile"


def test_played_frames_without_a_sign_count_as_none_by_their_stamps() -> None:
    played = PlayedTime(0.35)
    assert [played.note(0.1, counts=counts) for counts in (True, False, False, False)] == [False] * 4
    assert played.note(0.1, counts=False)
    assert not played.note(0.1, counts=True)


def test_the_hint_waits_until_frames_have_come_in_step(caplog: pytest.LogCaptureFixture) -> None:
    recording = Recording("auto")
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
    recording = Recording("auto")
    for number in range(40):
        now_s = 1000.0 + number / 10
        recording.follows(now_s, now_s - 60.0 - number * step_s, by_player=False)
        assert recording.hint(now_s) is None


def test_frames_that_come_a_little_late_are_no_recording() -> None:
    recording = Recording("auto")
    followed(recording, [3.0] * 40)
    assert recording.hint(1_000_004.0) is None


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(7.4, "7 s"), (600.0, "10 minutes"), (8000.0, "2 hours"), (DAYS_S, "3 days"), (1e9, "32 years")],
)
def test_durations_in_words(seconds: float, words: str) -> None:
    assert duration_in_words(seconds) == words
