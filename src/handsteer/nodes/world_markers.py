"""The obstacles of a world as markers, which RViz and the page can draw."""

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
from handsteer.robots.protocol import Obstacle

_TYPES = {"box": 1, "sphere": 2, "cylinder": 3}
_ADD = 0
_EMPTY = np.zeros(0, np.uint8)


def world_markers(header: Header, obstacles: list[Obstacle]) -> MarkerArray:
    """Return ``obstacles`` as markers of the namespace ``world``, numbered in their order."""
    markers = [_marker(header, number, obstacle) for number, obstacle in enumerate(obstacles)]
    # rosbags shares this one class among releases, annotated with the first one's Marker.
    return MarkerArray(markers=markers)  # type: ignore[arg-type]


def _marker(header: Header, number: int, obstacle: Obstacle) -> Marker:
    return Marker(
        header=header,
        ns="world",
        id=number,
        type=_TYPES[obstacle.shape],
        action=_ADD,
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
        text="",  # RViz warns of text on any shape but text
        mesh_resource="",
        mesh_file=MeshFile(filename="", data=_EMPTY),
        mesh_use_embedded_materials=False,
    )
