from handsteer.nodes.stall_guard import StallGuard
from handsteer.timeouts import BURST_S, HELD_UP_S


def test_what_comes_soon_after_an_interruption_is_distrusted() -> None:
    interruption = StallGuard(0.35, 0.0)
    assert not interruption.note(0.3)
    assert not interruption.distrusts(0.3)
    assert interruption.note(1.0)
    assert interruption.distrusts(1.0)
    assert interruption.distrusts(1.0 + HELD_UP_S / 2)
    assert not interruption.distrusts(1.0 + HELD_UP_S)


def test_a_burst_is_distrusted_to_its_end_however_long_it_takes() -> None:
    interruption = StallGuard(0.35, 0.0)
    interruption.note(1.0)
    now_s = 1.0
    while now_s < 1.0 + 5 * HELD_UP_S:
        assert interruption.distrusts(now_s)
        now_s += BURST_S / 2
    now_s += BURST_S
    assert not interruption.distrusts(now_s)
    assert not interruption.distrusts(now_s + BURST_S / 2)  # as fast as it may be, it is no backlog


def test_what_comes_fast_without_an_interruption_is_trusted() -> None:
    interruption = StallGuard(0.35, 0.0)
    for number in range(1000):
        interruption.note(number / 1000)
        assert not interruption.distrusts(number / 1000)
