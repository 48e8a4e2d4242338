import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.dashboard.seat import ANSWER_S, Place, Seat


@pytest.fixture
def seat() -> Seat:
    seat = Seat()
    assert seat.take("anna", 0.0)
    return seat


def test_the_first_who_comes_drives_and_the_others_watch(seat: Seat) -> None:
    assert not seat.take("ben", 1.0)
    assert seat.take("anna", 2.0)
    assert seat.place_of("anna", 2.0) == Place("driver")
    assert seat.place_of("ben", 2.0) == Place("watcher")


def test_a_driver_who_leaves_frees_the_seat(seat: Seat) -> None:
    assert not seat.leave("ben")
    assert seat.leave("anna")
    assert seat.place_of("ben", 1.0) == Place("free")
    assert seat.take("ben", 1.0)


def test_the_driver_may_hand_over(seat: Seat) -> None:
    seat.ask("ben", 1.0)
    assert seat.place_of("anna", 4.0) == Place("driver", asked=True, left_s=ANSWER_S - 3)
    assert seat.place_of("ben", 4.0) == Place("watcher", asked=True, left_s=ANSWER_S - 3)
    assert not seat.answer("ben", hand_over=True)  # nobody grants his own request
    assert seat.answer("anna", hand_over=True)
    assert seat.drives("ben")
    assert not seat.drives("anna")


def test_the_driver_may_refuse_and_the_other_ask_again(seat: Seat) -> None:
    seat.ask("ben", 1.0)
    assert not seat.answer("anna", hand_over=False)
    assert seat.place_of("ben", 1.0) == Place("watcher")
    assert not seat.tick(1.0 + 2 * ANSWER_S)
    seat.ask("ben", 30.0)
    assert seat.place_of("ben", 30.0).asked


def test_a_driver_who_does_not_answer_hands_over(seat: Seat) -> None:
    seat.ask("ben", 1.0)
    assert not seat.tick(0.9 + ANSWER_S)
    assert seat.tick(1.0 + ANSWER_S)
    assert not seat.take("anna", 2.0 + ANSWER_S)
    assert seat.drives("ben")


def test_the_seat_goes_to_who_has_asked_when_the_driver_leaves(seat: Seat) -> None:
    seat.ask("ben", 1.0)
    seat.ask("carla", 2.0)
    seat.leave("anna")
    assert seat.drives("ben")


MOVES = ("take", "ask", "grant", "refuse", "leave", "tick")


@given(st.lists(st.tuples(st.sampled_from(MOVES), st.sampled_from("abc"), st.floats(0, 15))))
def test_there_is_never_more_than_one_driver(moves: list[tuple[str, str, float]]) -> None:
    seat, now_s = Seat(), 0.0
    for move, viewer, passed_s in moves:
        now_s += passed_s
        match move:
            case "take":
                seat.take(viewer, now_s)
            case "ask":
                seat.ask(viewer, now_s)
            case "grant" | "refuse":
                seat.answer(viewer, hand_over=move == "grant")
            case "leave":
                seat.leave(viewer)
                assert not seat.drives(viewer)
            case "tick":
                seat.tick(now_s)
        roles = [seat.place_of(viewer, now_s).role for viewer in "abc"]
        assert roles.count("driver") <= 1
        assert ("free" in roles) == (roles == ["free"] * 3)
