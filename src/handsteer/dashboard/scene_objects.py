"""Objects of the 3D view beyond NiceGUI's: robot and camera, scan, and trail, each with a small script."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from nicegui import ui
from nicegui.elements.scene.scene_object3d import Object3D

from handsteer.robots.description import Joint

View = Literal["orbit", "follow", "top"]
"""``orbit`` follows the robot's position; ``follow`` also turns with it; ``top`` looks down, north (+y) up."""

_STATIC = Path(__file__).parent / "static"


class RobotRig(Object3D, component=_STATIC / "robot-rig.js"):
    """The robot, which moves the camera of ``scene`` with it.

    All motion is sent in one message, because the overhead per message exceeds the cost of its content.
    """

    def __init__(self, scene: ui.scene) -> None:
        super().__init__(scene.id, "orbit", [], 0.0, 0.0, 0.0, [])
        self._names: tuple[str, ...] = ()

    def hold(self, links: Sequence[tuple[Joint, Object3D]]) -> None:
        """Control these links from now on, each by the angle of its joint."""
        self._names = tuple(joint.name for joint, _ in links)
        self.args[2] = [[link.id, *joint.rpy, *joint.axis] for joint, link in links]
        self.args[6] = [0.0] * len(links)
        self.run_method("hold", self.args[2])

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


class ScanDots(Object3D, component=_STATIC / "scan.js"):
    """A laser scan: a dot of ``size_m`` for each ray that hits something, ``height_m`` above the floor."""

    def __init__(self, size_m: float, height_m: float) -> None:
        super().__init__([], size_m, height_m)

    def show(self, points: Sequence[tuple[float, float]]) -> None:
        """Draw these points, x and y in metres, instead of the previous ones."""
        self.args[0] = [list(point) for point in points]
        self.run_method("show", self.args[0])


class TrailLine(Object3D, component=_STATIC / "trail.js"):
    """The robot's trail, ``width_m`` wide, of at most ``most`` points; the oldest are dropped."""

    def __init__(self, most: int, width_m: float) -> None:
        super().__init__([], most, width_m)

    def extend(self, points: Sequence[tuple[float, float]]) -> None:
        """Append ``points``, x and y in metres."""
        new = [[round(x, 2), round(y, 2)] for x, y in points]
        self.args[0] = [*self.args[0], *new][-self.args[1] :]
        self.run_method("extend", new)

    def clear(self) -> None:
        """Start again."""
        self.args[0] = []
        self.run_method("clear")
