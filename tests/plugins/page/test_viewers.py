import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.plugins.page.viewers import ALONE_S, ANSWER_S, ControlLease, FreeSeat, LeaseStatus


@pytest.fixture
def lease() -> ControlLease:
    lease = ControlLease()
    assert lease.take("anna", 0.0)
    return lease


def test_the_first_who_comes_drives_and_the_others_watch(lease: ControlLease) -> None:
    assert not lease.take("ben", 1.0)
    assert lease.take("anna", 2.0)
    assert lease.status_of("anna", 2.0) == LeaseStatus("driver")
    assert lease.status_of("ben", 2.0) == LeaseStatus("watcher")


def test_a_driver_who_leaves_frees_the_seat(lease: ControlLease) -> None:
    lease.leave("ben")
    assert lease.drives("anna")
    lease.leave("anna")
    assert lease.status_of("ben", 1.0) == LeaseStatus("free")
    assert lease.take("ben", 1.0)


def test_a_seat_that_is_free_for_a_moment_is_that_of_the_drivers_next_page() -> None:
    watcher, driver = FreeSeat(), FreeSeat()
    assert watcher.is_for(drove_last=None, is_alone=True, now_s=0.0), "the first page"
    assert not FreeSeat().is_for(drove_last=None, is_alone=False, now_s=0.0)
    assert not watcher.is_for(drove_last=False, is_alone=False, now_s=9.0)
    assert not watcher.is_for(drove_last=False, is_alone=True, now_s=10.0)
    assert driver.is_for(drove_last=True, is_alone=False, now_s=10.1)
    assert not watcher.is_for(drove_last=False, is_alone=False, now_s=10.1)
    assert not watcher.is_for(drove_last=False, is_alone=True, now_s=20.0)
    assert not watcher.is_for(drove_last=False, is_alone=True, now_s=20.0 + ALONE_S - 0.1)
    assert watcher.is_for(drove_last=False, is_alone=True, now_s=20.0 + ALONE_S)


def test_the_driver_may_hand_over(lease: ControlLease) -> None:
    lease.ask("ben", 1.0)
    assert lease.status_of("anna", 4.0) == LeaseStatus("driver", asked=True, left_s=ANSWER_S - 3)
    assert lease.status_of("ben", 4.0) == LeaseStatus("watcher", asked=True, left_s=ANSWER_S - 3)
    lease.answer("ben", hand_over=True)
    assert lease.drives("anna"), "nobody grants his own request"
    lease.answer("anna", hand_over=True)
    assert lease.drives("ben")
    assert not lease.drives("anna")


def test_the_driver_may_refuse_and_the_other_ask_again(lease: ControlLease) -> None:
    lease.ask("ben", 1.0)
    lease.answer("anna", hand_over=False)
    assert lease.status_of("ben", 1.0) == LeaseStatus("watcher")
    lease.tick(1.0 + 2 * ANSWER_S)
    assert lease.drives("anna")
    lease.ask("ben", 30.0)
    assert lease.status_of("ben", 30.0).asked


def test_a_driver_who_does_not_answer_hands_over(lease: ControlLease) -> None:
    lease.ask("ben", 1.0)
    lease.tick(0.9 + ANSWER_S)
    assert lease.drives("anna")
    lease.tick(1.0 + ANSWER_S)
    assert lease.drives("ben")
    assert not lease.take("anna", 2.0 + ANSWER_S)


def test_the_seat_goes_to_who_has_asked_when_the_driver_leaves(lease: ControlLease) -> None:
    lease.ask("ben", 1.0)
    lease.ask("carla", 2.0)
    lease.leave("anna")
    assert lease.drives("ben")


MOVES = ("take", "ask", "grant", "refuse", "leave", "tick")


@given(st.lists(st.tuples(st.sampled_from(MOVES), st.sampled_from("abc"), st.floats(0, 15))))
def test_there_is_never_more_than_one_driver(moves: list[tuple[str, str, float]]) -> None:
    lease, now_s = ControlLease(), 0.0
    for move, viewer, passed_s in moves:
        now_s += passed_s
        match move:
            case "take":
                lease.take(viewer, now_s)
            case "ask":
                lease.ask(viewer, now_s)
            case "grant" | "refuse":
                lease.answer(viewer, hand_over=move == "grant")
            case "leave":
                lease.leave(viewer)
                assert not lease.drives(viewer)
            case "tick":
                lease.tick(now_s)
        roles = [lease.status_of(viewer, now_s).role for viewer in "abc"]
        assert roles.count("driver") <= 1
        assert ("free" in roles) == (roles == ["free"] * 3)
