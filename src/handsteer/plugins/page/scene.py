"""The 3D view: a fixed world, the robot that drives in it, and a camera that follows the robot.

The camera moves in the browser, so that viewers can also turn and zoom it.
"""

import logging
import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Literal

import cv2
import numpy as np
from nicegui import ui
from nicegui.elements.scene.scene_object3d import Object3D
from numpy.typing import NDArray

from handsteer.errors import WorldError
from handsteer.messages import Marker, Quaternion
from handsteer.plugins.page.elements import STATIC
from handsteer.plugins.page.urdf import Joint, Vector, joints, visuals
from handsteer.plugins.page.world_state import TRAIL_POINTS, Point, Trail, WorldState

View = Literal["orbit", "follow", "top"]
"""``orbit`` follows the robot's position; ``follow`` also turns with it; ``top`` looks down, north (+y) up."""

_LINES = "#2b3c63"
_FLOOR_RADIUS_M = 12
_LINE_WIDTH_M = 0.015
_TURNING = {"continuous", "revolute"}

log = logging.getLogger(__name__)


class WorldView:
    """Shows a :class:`~handsteer.plugins.page.world_state.WorldState`; updates only what has moved."""

    def __init__(self) -> None:
        camera = ui.scene.perspective_camera(fov=45, near=0.05, far=200)
        self._scene = ui.scene(grid=False, camera=camera, background_color="#0d1424", fps=20, click_events=[])
        self._shown = WorldState()
        self._obstacles: dict[tuple[str, int], tuple[int, Object3D]] = {}
        self._view: View = "orbit"
        with self._scene:
            with self._scene.group() as self._floor:
                _draw_floor(self._scene)
            self._trail = TrailLine([], TRAIL_POINTS, 0.05).material("#7aa7ff", 0.75, "both").move(z=0.004)
            self._scan = ScanDots([], 0.05, 0.16).material("#ff6a5e")
            self._arc = ScanDots([], 0.06, 0.01).material("#7dff9b")
            self._robot = RobotRig(self._scene)
        # After the scene's own handler, which would move the camera.
        self._scene.on("init", lambda: self._robot.look(self._view))

    def update(self, world: WorldState) -> None:
        """Show ``world``."""
        shown, self._shown = self._shown, world
        if world.description and world.description != shown.description:
            self._draw_robot(world.description)
        if world.robot != shown.robot or world.joints != shown.joints:
            self._robot.go(world.robot.x, world.robot.y, world.robot.yaw, dict(world.joints))
            self._floor.move(round(world.robot.x), round(world.robot.y))
        if world.trail is not shown.trail:
            self._trail.extend(shown.trail, world.trail)
        if world.scan != shown.scan:
            self._scan.show(world.scan)
        if world.arc != shown.arc:
            self._arc.show(world.arc)
        if world.markers is not shown.markers:
            self._show_obstacles(world.markers)

    def look(self, view: View) -> None:
        """Move the camera to the start of ``view``."""
        self._view = view
        self._robot.look(view)

    def _draw_robot(self, description: str) -> None:
        for link in self._robot.children:
            link.delete()
        try:
            shapes, chain = visuals(description), list(parents_first(joints(description)))
        except WorldError as error:
            log.warning("the page cannot show the robot: %s", error)
            return
        # A link without a parent joint is the root, which is the robot itself.
        links: defaultdict[str, Object3D] = defaultdict(lambda: self._robot)
        with self._scene:
            for joint in chain:
                with links[joint.parent]:
                    link = self._scene.group().move(*joint.xyz).rotate_R(from_rpy(joint.rpy).tolist())
                links[joint.child] = link
            for visual in shapes:
                with links[visual.link]:
                    shape = _URDF_SHAPES[visual.shape]
                    made = _SHAPES[shape](self._scene).move(*visual.xyz)
                _resize(made, shape, visual.size, from_rpy(visual.rpy))
                made.material(css_colour(visual.rgba[:3]), visual.rgba[3])
        self._robot.control([(each, links[each.child]) for each in chain if each.type in _TURNING])

    def _show_obstacles(self, markers: tuple[Marker, ...]) -> None:
        known = {
            (marker.ns, marker.id): marker for marker in markers if marker.type in _SHAPES and marker.action == _ADD
        }
        for key, (shape, made) in tuple(self._obstacles.items()):
            if key not in known or known[key].type != shape:
                made.delete()
                del self._obstacles[key]
        for key, marker in known.items():
            if key not in self._obstacles:
                with self._scene:
                    made = _SHAPES[marker.type](self._scene)
                self._obstacles[key] = (marker.type, made)
            _place(self._obstacles[key][1], marker)


# Shapes of visualization_msgs/Marker, created with unit size and scaled.
_CUBE, _SPHERE, _CYLINDER = 1, 2, 3
_ADD = 0
_URDF_SHAPES = {"box": _CUBE, "sphere": _SPHERE, "cylinder": _CYLINDER}
_SHAPES: dict[int, Callable[[ui.scene], Object3D]] = {
    _CUBE: lambda scene: scene.box(),
    _SPHERE: lambda scene: scene.sphere(0.5),
    _CYLINDER: lambda scene: scene.cylinder(0.5, 0.5, 1.0, 32),
}


def _place(made: Object3D, marker: Marker) -> None:
    position, colour = marker.pose.position, marker.color
    made.move(round(position.x, 3), round(position.y, 3), round(position.z, 3))
    size = (marker.scale.x, marker.scale.y, marker.scale.z)
    _resize(made, marker.type, size, from_quaternion(marker.pose.orientation))
    made.material(css_colour((colour.r, colour.g, colour.b)), colour.a)


def _resize(made: Object3D, shape: int, size: Vector, turn: "Rotation") -> None:
    if shape == _CYLINDER:
        size, turn = (size[0], size[2], size[1]), turn @ _Z_TO_Y
    made.scale(*size).rotate_R(turn.round(4).tolist())


def _draw_floor(scene: ui.scene) -> None:
    """Draw a disc with a line every metre."""
    disc = scene.cylinder(_FLOOR_RADIUS_M, _FLOOR_RADIUS_M, 0.01, 96).material("#151f36")
    disc.rotate_R(_Z_TO_Y.tolist()).move(z=-0.008)
    for at in range(1 - _FLOOR_RADIUS_M, _FLOOR_RADIUS_M):
        reach = math.sqrt(_FLOOR_RADIUS_M**2 - at**2)
        scene.box(_LINE_WIDTH_M, 2 * reach, 0.001).move(x=at).material(_LINES)
        scene.box(2 * reach, _LINE_WIDTH_M, 0.001).move(y=at).material(_LINES)


class RobotRig(Object3D, component=STATIC / "robot-rig.js"):
    """The robot, which moves the camera of ``scene`` with it.

    All motion is sent in one message, because the overhead per message exceeds the cost of its content.
    """

    def __init__(self, scene: ui.scene) -> None:
        super().__init__(scene.id, "orbit", [], 0.0, 0.0, 0.0, [])
        self._names: tuple[str, ...] = ()

    def control(self, links: Sequence[tuple[Joint, Object3D]]) -> None:
        """Control these links from now on, each by the angle of its joint."""
        self._names = tuple(joint.name for joint, _ in links)
        self.args[2] = [[link.id, *joint.rpy, *joint.axis] for joint, link in links]
        self.args[6] = [0.0] * len(links)
        self.run_method("control", self.args[2])

    def go(self, x: float, y: float, yaw: float, angles: Mapping[str, float]) -> None:
        """Move to x and y in metres, heading ``yaw`` in rad, with joints at ``angles`` in rad; 0 if missing."""
        turned = [round(angles.get(name, 0.0), 2) for name in self._names]
        pose = [round(x, 3), round(y, 3), round(yaw, 3), turned]
        if pose != self.args[3:]:
            self.args[3:] = pose
            self.run_method("go", *pose)

    def look(self, view: View) -> None:
        """Move the camera to the start of ``view``."""
        self.args[1] = view
        self.run_method("look", view)


class ScanDots(Object3D, component=STATIC / "scan.js"):
    """Dots of a laser scan, or of an arc; its arguments are the points, and the dots' size and height in metres."""

    def show(self, points: Sequence[Point]) -> None:
        """Draw these points instead of the previous ones."""
        self.args[0] = [list(point) for point in points]
        self.run_method("show", self.args[0])


class TrailLine(Object3D, component=STATIC / "trail.js"):
    """The robot's trail; its arguments are the points, the most of them, and the line's width in metres."""

    def extend(self, shown: Trail, trail: Trail) -> None:
        """Draw ``trail``, of which ``shown`` is drawn already, unless it is an earlier one."""
        if trail.number != shown.number:
            self.args[0] = []
            self.run_method("clear")
            shown = Trail()
        if points := trail.since(shown):
            new = [[round(x, 2), round(y, 2)] for x, y in points]
            self.args[0] = [*self.args[0], *new][-self.args[1] :]
            self.run_method("extend", new)


Rotation = NDArray[np.float64]
"""A rotation matrix, (3, 3)."""


def about_axis(axis: Vector, angle: float) -> Rotation:
    """Return the rotation by ``angle`` in rad about ``axis`` of any length; none for axis 0."""
    length = math.hypot(*axis) or 1.0
    return np.asarray(cv2.Rodrigues(np.array([angle * part / length for part in axis]))[0], np.float64)


def from_rpy(rpy: Vector) -> Rotation:
    """Return the rotation of roll, pitch and yaw in rad about fixed axes (REP 103)."""
    roll, pitch, yaw = rpy
    return about_axis((0, 0, 1), yaw) @ about_axis((0, 1, 0), pitch) @ about_axis((1, 0, 0), roll)


def from_quaternion(quaternion: Quaternion) -> Rotation:
    """Return the rotation of ``quaternion``, of any length; identity for all zeros, which some nodes publish."""
    axis = (quaternion.x, quaternion.y, quaternion.z)
    return about_axis(axis, 2 * math.atan2(math.hypot(*axis), quaternion.w))


def css_colour(rgb: Iterable[float]) -> str:
    """Return a CSS colour for red, green and blue, clamped to 0 to 1."""
    return "#" + "".join(f"{round(255 * max(0.0, min(part, 1.0))):02x}" for part in rgb)


def parents_first(joints: Iterable[Joint]) -> Iterator[Joint]:
    """Yield each joint after its parent's joint; joints in a loop are left out."""
    waiting = list(joints)
    while waiting:
        children = {joint.child for joint in waiting}
        ready = [joint for joint in waiting if joint.parent not in children]
        if not ready:
            return
        yield from ready
        waiting = [joint for joint in waiting if joint.parent in children]


# A cylinder's axis is y in three.js, and z in ROS.
_Z_TO_Y: Rotation = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
