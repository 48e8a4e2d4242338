"""Markers of the obstacles and gates of a world, for RViz and the page."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from handsteer.messages import (
    ColorRGBA,
    CompressedImage,
    Duration,
    Header,
    Marker,
    MarkerArray,
    MeshFile,
    Point,
    Pose,
    Quaternion,
    Vector3,
)
from handsteer.robots import Obstacle
from handsteer.robots.world import Gate
from handsteer.types import CourseState

OBSTACLES, GATES = "world", "gates"
"""Namespaces of the markers."""

_TYPES = {"box": 1, "sphere": 2, "cylinder": 3}
_ADD, _DELETE = 0, 2
_EMPTY = np.zeros(0, np.uint8)

_TOUCHED = (1.0, 0.16, 0.12, 1.0)
_NEXT_GATE = (1.0, 0.8, 0.1, 1.0)
_PASSED_GATE = (0.16, 0.6, 0.35, 1.0)
_MISSED_GATE = (0.8, 0.25, 0.2, 1.0)
_LATER_GATE = (0.4, 0.47, 0.6, 1.0)
_FLASH_S = 0.7
_STRIP_WIDTH_M = 0.06
_STRIP_HEIGHT_M = 0.01
_GONE = Obstacle("", "box", (1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


class Touches:
    """Remembers briefly what the robot has touched, so that it stays visible."""

    def __init__(self) -> None:
        self._until_s: dict[str, float] = {}

    def note(self, contacts: Iterable[str], now_s: float) -> None:
        """Record the names of what the robot touches at ``now_s``."""
        self._until_s.update(dict.fromkeys(contacts, now_s + _FLASH_S))

    def shown(self, now_s: float) -> list[str]:
        """Return the names of what it touches, or touched a moment ago."""
        self._until_s = {name: until_s for name, until_s in self._until_s.items() if until_s > now_s}
        return [*self._until_s]


def world_markers(
    header: Header,
    obstacles: Sequence[Obstacle],
    strips: Sequence[Obstacle] = (),
    touched: Sequence[str] = (),
    most: int = 0,
) -> MarkerArray:
    """Return a world as markers, numbered in order.

    Args:
        header: Of each marker.
        obstacles: Those of the namespace ``world``.
        strips: Those of the namespace ``gates``.
        touched: Names of obstacles to draw red.
        most: The largest number of obstacles so far: markers of removed ones are deleted.
    """
    markers = [
        _marker(header, OBSTACLES, number, replace(obstacle, rgba=_TOUCHED) if obstacle.name in touched else obstacle)
        for number, obstacle in enumerate(obstacles)
    ]
    markers += [_marker(header, GATES, number, strip) for number, strip in enumerate(strips)]
    markers += [_marker(header, OBSTACLES, number, _GONE, _DELETE) for number in range(len(obstacles), most)]
    # rosbags shares this class among releases, annotated with the first one's Marker.
    return MarkerArray(markers=markers)  # type: ignore[arg-type]


def gate_strips(gates: Sequence[Gate], state: CourseState) -> list[Obstacle]:
    """Return ``gates`` as strips on the floor, with different colours for the next, passed and missed ones."""
    return [_strip(gate, _gate_colour(index, state)) for index, gate in enumerate(gates)]


def _gate_colour(index: int, state: CourseState) -> tuple[float, float, float, float]:
    if index in state.missed:
        return _MISSED_GATE
    if index < state.next_gate:
        return _PASSED_GATE
    return _NEXT_GATE if index == state.next_gate else _LATER_GATE


def _strip(gate: Gate, rgba: tuple[float, float, float, float]) -> Obstacle:
    (left_x, left_y), (right_x, right_y) = gate.left, gate.right
    half_yaw = math.atan2(right_y - left_y, right_x - left_x) / 2
    return Obstacle(
        name=gate.name,
        shape="box",
        size=(math.dist(gate.left, gate.right), _STRIP_WIDTH_M, _STRIP_HEIGHT_M),
        rgba=rgba,
        position=((left_x + right_x) / 2, (left_y + right_y) / 2, _STRIP_HEIGHT_M / 2),
        orientation=(0.0, 0.0, math.sin(half_yaw), math.cos(half_yaw)),
    )


def _marker(
    header: Header,
    namespace: str,
    number: int,
    obstacle: Obstacle,
    action: int = _ADD,
) -> Marker:
    return Marker(
        header=header,
        ns=namespace,
        id=number,
        type=_TYPES[obstacle.shape],
        action=action,
        pose=Pose(position=Point(*obstacle.position), orientation=Quaternion(*obstacle.orientation)),
        scale=Vector3(*obstacle.size),
        color=ColorRGBA(*obstacle.rgba),
        lifetime=Duration(sec=0, nanosec=0),
        frame_locked=False,
        points=[],
        colors=[],
        texture_resource="",
        texture=CompressedImage(header=header, format="", data=_EMPTY),
        uv_coordinates=[],
        text="",  # RViz warns of text on any other shape
        mesh_resource="",
        mesh_file=MeshFile(filename="", data=_EMPTY),
        mesh_use_embedded_materials=False,
    )
