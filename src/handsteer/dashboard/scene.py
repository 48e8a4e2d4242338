"""The 3D view: the robot in the middle, and the world that moves past it.

The robot stays where it is and the world is moved instead. So the view follows the robot, and people can still turn
and zoom it as they like.
"""

import logging
import math
from collections import defaultdict
from collections.abc import Callable

import numpy as np
from nicegui import ui
from nicegui.elements.scene.scene_object3d import Object3D

from handsteer.dashboard.geometry import Rotation, about_axis, css_colour, from_quaternion, from_rpy, parents_first
from handsteer.dashboard.node import WorldState
from handsteer.errors import WorldError
from handsteer.messages import Marker
from handsteer.robots.description import Joint, Vector, Visual, joints, visuals

log = logging.getLogger(__name__)

_SKY = "#0d1424"
_FLOOR = "#151f36"
_LINES = "#2b3c63"
_FLOOR_RADIUS_M = 12
_LINE_WIDTH_M = 0.015
_FRAMES_PER_S = 20

# Shapes of visualization_msgs/Marker. Each is made with unit size, and its size is a scale.
_CUBE, _SPHERE, _CYLINDER = 1, 2, 3

_TURNING = {"continuous", "revolute"}

# three.js has the axis of a cylinder along y, ROS along z.
_Z_TO_Y: Rotation = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


class WorldView:
    """Shows a :class:`~handsteer.dashboard.node.WorldState`, and then moves only what has moved."""

    def __init__(self) -> None:
        camera = ui.scene.perspective_camera(fov=45, near=0.05, far=200)
        scene = ui.scene(grid=False, camera=camera, background_color=_SKY, fps=_FRAMES_PER_S, click_events=[])
        self._scene = scene
        self._shown = WorldState()
        self._obstacles: dict[tuple[str, int], tuple[int, Object3D]] = {}
        self._joints: dict[str, tuple[Joint, Object3D]] = {}
        with scene:
            with scene.group() as self._world, scene.group() as self._floor:
                _draw_floor(scene)
            self._robot = scene.group()
        scene.move_camera(x=-1.6, y=-0.7, z=1.05, look_at_x=0.6, look_at_y=0.1, look_at_z=0.0, duration=0)

    def update(self, world: WorldState) -> None:
        """Show ``world``."""
        shown, self._shown = self._shown, world
        if world.description and world.description != shown.description:
            self._draw_robot(world.description)
        if world.joints is not shown.joints:
            self._turn_joints(dict(world.joints))
        if world.robot != shown.robot:
            self._world.move(-world.robot.x, -world.robot.y)
            self._floor.move(round(world.robot.x), round(world.robot.y))
            self._robot.rotate(0.0, 0.0, world.robot.yaw)
        if world.markers is not shown.markers:
            self._show_obstacles(world.markers)

    def _draw_robot(self, description: str) -> None:
        for link in self._robot.children:
            link.delete()
        self._joints.clear()
        try:
            shapes, held = visuals(description), joints(description)
        except WorldError as error:
            log.warning("the page cannot show the robot: %s", error)
            return
        # A link that no joint holds is the root, which is the robot itself.
        links: defaultdict[str, Object3D] = defaultdict(lambda: self._robot)
        with self._scene:
            for joint in parents_first(held):
                with links[joint.parent]:
                    link = self._scene.group().move(*joint.xyz).rotate_R(from_rpy(joint.rpy).tolist())
                links[joint.child] = link
                self._joints[joint.name] = (joint, link)
            for visual in shapes:
                with links[visual.link]:
                    _draw(self._scene, visual)

    def _turn_joints(self, angles: dict[str, float]) -> None:
        for name in angles.keys() & self._joints.keys():
            joint, link = self._joints[name]
            if joint.type in _TURNING:
                link.rotate_R((from_rpy(joint.rpy) @ about_axis(joint.axis, angles[name])).round(4).tolist())

    def _show_obstacles(self, markers: tuple[Marker, ...]) -> None:
        known = {(marker.ns, marker.id): marker for marker in markers if marker.type in _SHAPES}
        for key in self._obstacles.keys() - known.keys():
            self._obstacles.pop(key)[1].delete()
        for key, marker in known.items():
            if key not in self._obstacles or self._obstacles[key][0] != marker.type:
                self._make_obstacle(key, marker.type)
            _place(self._obstacles[key][1], marker)

    def _make_obstacle(self, key: tuple[str, int], shape: int) -> None:
        if key in self._obstacles:
            self._obstacles.pop(key)[1].delete()
        with self._scene, self._world:
            self._obstacles[key] = (shape, _SHAPES[shape](self._scene))


def _draw(scene: ui.scene, visual: Visual) -> None:
    shape = _SHAPES[_URDF_SHAPES[visual.shape]](scene)
    _resize(shape, visual.size, from_rpy(visual.rpy), is_cylinder=visual.shape == "cylinder")
    shape.move(*visual.xyz).material(css_colour(visual.rgba[:3]), visual.rgba[3])


_URDF_SHAPES = {"box": _CUBE, "sphere": _SPHERE, "cylinder": _CYLINDER}
_SHAPES: dict[int, Callable[[ui.scene], Object3D]] = {
    _CUBE: lambda scene: scene.box(),
    _SPHERE: lambda scene: scene.sphere(0.5),
    _CYLINDER: lambda scene: scene.cylinder(0.5, 0.5, 1.0, 32),
}


def _place(shape: Object3D, marker: Marker) -> None:
    position, size = marker.pose.position, (marker.scale.x, marker.scale.y, marker.scale.z)
    shape.move(position.x, position.y, position.z)
    _resize(shape, size, from_quaternion(marker.pose.orientation), is_cylinder=marker.type == _CYLINDER)
    shape.material(css_colour((marker.color.r, marker.color.g, marker.color.b)), marker.color.a)


def _resize(shape: Object3D, size: Vector, turn: Rotation, *, is_cylinder: bool) -> None:
    x, y, z = size
    shape.scale(*((x, z, y) if is_cylinder else size)).rotate_R((turn @ _Z_TO_Y if is_cylinder else turn).tolist())


def _draw_floor(scene: ui.scene) -> None:
    """Draw a disc with a line every metre."""
    disc = scene.cylinder(_FLOOR_RADIUS_M, _FLOOR_RADIUS_M, 0.01, 96).material(_FLOOR)
    disc.rotate_R(_Z_TO_Y.tolist()).move(z=-0.008)
    for at in range(1 - _FLOOR_RADIUS_M, _FLOOR_RADIUS_M):
        reach = math.sqrt(_FLOOR_RADIUS_M**2 - at**2)
        scene.box(_LINE_WIDTH_M, 2 * reach, 0.001).move(x=at).material(_LINES)
        scene.box(2 * reach, _LINE_WIDTH_M, 0.001).move(y=at).material(_LINES)
