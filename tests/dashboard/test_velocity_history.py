from handsteer.dashboard.drive_page import rows_of
from handsteer.dashboard.world_state import PERIOD_S, SPAN_S, Sample, VelocityHistory
from handsteer.types import Velocity


def driven(history: VelocityHistory, seconds: float, begin_s: float = 0.0) -> float:
    for n in range(round(seconds / PERIOD_S)):
        history.add(Sample(begin_s + n * PERIOD_S, Velocity(0.5, 0.0), None))
    return begin_s + seconds


def test_gives_each_sample_once() -> None:
    history = VelocityHistory()
    now_s = driven(history, 1.0)
    count, first = history.since(0, now_s)
    assert len(first) == round(1.0 / PERIOD_S)
    assert history.since(count, now_s) == (count, [])
    now_s = driven(history, 0.2, now_s)
    assert [sample.at_s for sample in history.since(count, now_s)[1]] == [1.0 + n * PERIOD_S for n in range(4)]


def test_keeps_no_more_than_the_last_30_s() -> None:
    history = VelocityHistory()
    now_s = driven(history, 100.0)
    _, samples = history.since(0, now_s)
    assert len(samples) == round(SPAN_S / PERIOD_S)
    assert samples[0].at_s >= now_s - SPAN_S
    assert history.since(0, now_s + 10.0)[1][0].at_s >= now_s + 10.0 - SPAN_S
    assert history.since(0, now_s + 60.0)[1] == []


def test_two_who_sample_at_once_fill_it_no_faster() -> None:
    history = VelocityHistory()
    for n in range(100):
        history.add(Sample(n * PERIOD_S / 2.5, None, None))
    assert len(history.since(0, 0.0)[1]) <= 50


def test_rows_are_short_and_tell_a_gap_from_zero() -> None:
    samples = [Sample(1.23456, Velocity(0.12345, -1.0), None), Sample(1.3, None, Velocity(0.0, 0.25))]
    assert rows_of(samples) == ([(1.23, 0.123, None), (1.3, None, 0.0)], [(1.23, -1.0, None), (1.3, None, 0.25)])
