from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import SignsConfig
from handsteer.recognition.debouncer import Debouncer
from handsteer.types import FORWARD, GO, NONE, SIGNS, STOP, TURN_LEFT

DT = 1 / 30


def show(signs: Debouncer, seen: str, frames: int) -> list[str]:
    return [signs.step(seen, DT) for _ in range(frames)]


def test_a_sign_counts_within_100_ms_at_30_frames_a_second() -> None:
    signs = Debouncer(SignsConfig())
    assert show(signs, FORWARD, 5) == [NONE, NONE, NONE, FORWARD, FORWARD]


@given(st.floats(0, 1e6), st.sampled_from([10, 30, 60]))
def test_it_takes_as_many_frames_however_stamps_are_rounded(start_s: float, fps: int) -> None:
    signs, stamps = Debouncer(SignsConfig()), [start_s + frame / fps for frame in range(10)]
    intervals = [0.0, *(after - before for before, after in pairwise(stamps))]
    assert [signs.step(FORWARD, dt_s) for dt_s in intervals].index(FORWARD) == fps // 10
    assert [signs.step(NONE, 1 / fps) for _ in range(10)].count(FORWARD) == fps // 10


def test_stop_counts_at_its_first_frame() -> None:
    signs = Debouncer(SignsConfig())
    show(signs, FORWARD, 10)
    assert signs.step(STOP, DT) == STOP


def test_another_sign_for_two_frames_is_swallowed() -> None:
    signs = Debouncer(SignsConfig())
    show(signs, FORWARD, 10)
    assert show(signs, TURN_LEFT, 2) + show(signs, FORWARD, 2) == [FORWARD] * 4


def test_a_short_loss_is_bridged_and_a_long_one_is_not() -> None:
    signs = Debouncer(SignsConfig(dropout_hold=0.1))
    show(signs, FORWARD, 10)
    assert show(signs, NONE, 5) == [FORWARD, FORWARD, FORWARD, NONE, NONE]


def test_from_one_sign_to_another_the_first_holds_until_the_second_counts() -> None:
    signs = Debouncer(SignsConfig(confirm_time=0.1, dropout_hold=0.1))
    show(signs, GO, 10)
    assert show(signs, FORWARD, 4) == [GO, GO, GO, FORWARD]


def test_progress_grows_to_confirmation() -> None:
    signs = Debouncer(SignsConfig(confirm_time=0.1))
    progress = []
    for _ in range(3):
        signs.step(FORWARD, DT)
        progress.append(round(signs.progress, 2))
    assert progress == [0.0, 0.33, 0.67]
    assert signs.candidate == FORWARD


def test_reset_forgets() -> None:
    signs = Debouncer(SignsConfig())
    show(signs, FORWARD, 10)
    signs.reset()
    assert signs.step(FORWARD, DT) == NONE


@given(st.lists(st.tuples(st.sampled_from([*SIGNS, NONE]), st.floats(0.001, 0.2)), max_size=300))
def test_a_sign_never_counts_that_was_not_seen_for_the_whole_confirmation(frames: list[tuple[str, float]]) -> None:
    config = SignsConfig()
    signs = Debouncer(config)
    run_s, last, before = 0.0, NONE, NONE
    for seen, dt_s in frames:
        run_s = run_s + dt_s if seen == last else 0.0
        last = seen
        counted = signs.step(seen, dt_s)
        if counted not in (before, NONE, STOP):
            assert counted == seen
            assert run_s >= config.confirm_time - 0.001  # the slack for stamps that jitter
        before = counted
