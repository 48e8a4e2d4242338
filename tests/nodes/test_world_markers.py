import math

import pytest

from handsteer.clock import to_stamp
from handsteer.messages import Header, yaw_of
from handsteer.nodes.world_markers import Touches, gate_strips, world_markers
from handsteer.robots import Obstacle
from handsteer.robots.world import Gate
from handsteer.types import CourseState

HEADER = Header(stamp=to_stamp(0.0), frame_id="odom")
GREY = (0.5, 0.5, 0.5, 1.0)


def crate(name: str) -> Obstacle:
    return Obstacle(name, "box", (1.0, 2.0, 3.0), GREY, (0.0, 0.0, 1.5), (0.0, 0.0, 0.0, 1.0))


def test_what_is_touched_is_red() -> None:
    one, two = world_markers(HEADER, [crate("a"), crate("b")], touched=("b",)).markers
    assert (one.color.r, one.color.g) == (0.5, 0.5)
    assert two.color.r > 0.9
    assert two.color.g < 0.3


def test_a_touch_is_seen_for_a_moment() -> None:
    touches = Touches()
    touches.note(["a"], 0.0)
    touches.note(["b"], 0.5)
    touches.note([], 0.6)
    assert touches.shown(0.6) == ["a", "b"]
    assert touches.shown(0.8) == ["b"]
    assert touches.shown(2.0) == []


def test_what_is_gone_is_deleted() -> None:
    markers = world_markers(HEADER, [crate("a")], most=3).markers
    assert [(marker.ns, marker.id, marker.action) for marker in markers] == [
        ("world", 0, 0),
        ("world", 1, 2),
        ("world", 2, 2),
    ]


def test_gates_are_strips_whose_colours_tell_the_next_one() -> None:
    gates = [Gate(name=str(x), left=(x, 1.0), right=(x, -1.0)) for x in (1.0, 2.0, 3.0, 4.0)]
    state = CourseState(4, next_gate=2, missed=frozenset({1}), phase="running")
    strips = gate_strips(gates, state)
    assert len({strip.rgba for strip in strips}) == 4
    assert (strips[0].position[:2], strips[0].size[0]) == ((1.0, 0.0), 2.0)
    markers = world_markers(HEADER, [], strips).markers
    assert [(marker.ns, marker.id) for marker in markers] == [("gates", n) for n in range(4)]
    assert yaw_of(markers[0].pose.orientation) == pytest.approx(-math.pi / 2)
