"""The simulated robot: its controller, physics and contacts."""

import logging

import mujoco
import numpy as np
from numpy.typing import NDArray

from handsteer.config import RobotConfig
from handsteer.errors import WorldError
from handsteer.plugins.sim import diff_drive
from handsteer.plugins.sim.diff_drive import DriveState
from handsteer.plugins.sim.physics import ROBOT_JOINT, TIMESTEP_S, WHEEL_JOINTS, Lidar, compile_model, thing_name
from handsteer.plugins.sim.walks import Walk, walks_in
from handsteer.robots import Obstacle, RangeScan, RobotState
from handsteer.robots.description import robot_description
from handsteer.robots.world import World, load_world
from handsteer.types import Pose2D, Velocity

_log = logging.getLogger(__name__)

# A touch lasts this long after the last contact, because pushing loses contact now and then.
_TOUCH_S = 0.2

# No valid simulation comes near it: a wheel at the limits of the configuration's defaults turns at 63 rad/s.
_WILD_SPEED = 1e5


class Contacts:
    """Finds the obstacles that the robot touches.

    Args:
        model: Model of the robot in ``world``.
        world: Provides the names of the obstacles.
    """

    def __init__(self, model: mujoco.MjModel, world: World) -> None:
        self._names = [thing.name for thing in world.obstacles]
        # For each geom the index of its obstacle, or -1; and whether it is a part of the robot.
        self._thing_of_geom = np.full(model.ngeom, -1)
        for index in range(len(self._names)):
            self._thing_of_geom[model.geom(thing_name(index)).id] = index
        robot = model.joint(ROBOT_JOINT).id
        self._is_robot_geom = model.body_rootid[model.geom_bodyid] == model.jnt_bodyid[robot]

    def touched(self, data: mujoco.MjData) -> list[str]:
        """Return the names of what the robot touches in ``data``, in the order of the world."""
        geoms = data.contact.geom
        touched = self._thing_of_geom[geoms[:, ::-1]][self._is_robot_geom[geoms]]
        return [self._names[index] for index in sorted(set(touched.tolist())) if index >= 0]


class SimulatedRobot:
    """The diff-drive robot of the URDF in a world, simulated by MuJoCo.

    The same commands in the same steps give the same path, bit for bit. Not thread-safe.

    Attributes:
        world: Its world.
        description: Its URDF.
        model: The MuJoCo model, for experiments.
        data: The MuJoCo state, for experiments.
    """

    def __init__(self, config: RobotConfig, world: World | None = None) -> None:
        """Put the robot at the origin of ``world``, by default the one that ``config`` names.

        ``config`` sets the wheel dimensions that the controller assumes; the wheels themselves are those of the URDF.

        Raises:
            WorldError: The world cannot be read, or an obstacle in it overlaps the robot.
        """
        self.description = robot_description()
        self._config = config
        self._asked_s = 0.0
        self._steps = 0
        self._command: Velocity | None = None
        self._walks: dict[int, Walk] = {}
        world = load_world(config.world) if world is None else world
        self._take(world, compile_model(self.description, world))
        self.reset()
        if touched := self._contacts.touched(self.data):
            raise WorldError(f"world {config.world}: {_at_start(touched[0])}")

    def command(self, linear_mps: float, angular_radps: float) -> None:
        """Command a velocity in m/s and rad/s, processed by :func:`handsteer.plugins.sim.diff_drive.step`."""
        self._command = Velocity(linear_mps, angular_radps)

    def step(self, dt_s: float) -> RobotState:
        """Advance time by ``dt_s`` seconds, in whole steps of 0.01 s; the remainder is carried to the next call."""
        self._asked_s += dt_s
        while (self._steps + 1) * TIMESTEP_S <= self._asked_s + 1e-9:
            self._steps += 1
            self._step_once()
        return self._state()

    def obstacles(self) -> list[Obstacle]:
        """Return the obstacles at their current places."""
        return [
            Obstacle(thing.name, thing.shape, thing.extent, thing.rgba, *self._thing_pose(index))
            for index, thing in enumerate(self.world.obstacles)
        ]

    def scan(self) -> RangeScan:
        """Return a scan of the current state."""
        return self._lidar.scan(self.data)

    def commanders(self) -> list[str]:
        """Return an empty list: it has no graph of its own."""
        return []

    def enter(self, world: World) -> None:
        """Move the robot to the start of another world: see :class:`~handsteer.robots.InWorld`."""
        model = compile_model(self.description, world)
        if touched := _touched_at_start(model, world):
            raise WorldError(_at_start(touched[0]))
        self._take(world, model)
        self.reset()

    def change(self, world: World) -> None:
        """Replace the world around the robot; odometry, wheel angles and collisions continue."""
        model = compile_model(self.description, world)
        before = {thing.name: (index, thing) for index, thing in enumerate(self.world.obstacles)}
        same = {
            index: before[thing.name][0]
            for index, thing in enumerate(world.obstacles)
            if thing.name in before and before[thing.name][1] == thing
        }
        new = {thing.name for index, thing in enumerate(world.obstacles) if index not in same}
        if touched := new.intersection(_touched_at_start(model, world)):
            raise WorldError(_at_start(min(touched)))
        walks: dict[int, Walk] = walks_in(world) | {
            now: self._walks[then] for now, then in same.items() if then in self._walks
        }
        movable = {now: then for now, then in same.items() if world.obstacles[now].movable}
        data = self._carried_over(model, movable, walks)
        if touched := new.intersection(Contacts(model, world).touched(data)):
            raise WorldError(f"{min(touched)!r} would overlap the robot: keep 0.35 m around it free")
        self._take(world, model)
        self.data = data
        self._walks = walks
        self._command = None
        self._stop()

    def reset(self) -> None:
        """Reset the robot, the obstacles, odometry and collisions; the time continues."""
        mujoco.mj_resetData(self.model, self.data)
        mujoco.mj_forward(self.model, self.data)
        self._command = None
        self._drive = DriveState()
        self._odometry = Pose2D(0.0, 0.0, 0.0)
        self._collisions = 0
        self._touched_until: dict[str, int] = {}
        self._walks = walks_in(self.world)

    def reset_odometry(self) -> None:
        """Set the odometry to 0 without moving the robot."""
        self._odometry = Pose2D(0.0, 0.0, 0.0)

    def close(self) -> None:
        """Forget the last command, so that the robot stops at once; may be called twice."""
        self._command = None
        self._stop()

    def _take(self, world: World, model: mujoco.MjModel) -> None:
        self.world = world
        self.model = model
        self.data = mujoco.MjData(model)
        joints = [model.joint(name) for name in WHEEL_JOINTS]
        self._wheel_angles = np.array([joint.qposadr[0] for joint in joints])
        self._wheel_speeds = np.array([joint.dofadr[0] for joint in joints])
        self._contacts = Contacts(model, world)
        self._lidar = Lidar(model, self.description)
        self._pose_at = int(model.joint(ROBOT_JOINT).qposadr[0])

    def _carried_over(self, model: mujoco.MjModel, same: dict[int, int], walks: dict[int, Walk]) -> mujoco.MjData:
        """Return a state of ``model`` at rest, with the robot at its current place.

        Args:
            model: The new one.
            same: Movable things that also keep their places: index in the new world to index in the current one.
            walks: Where the things with a route are, by their index in the new world.
        """
        data = mujoco.MjData(model)
        joints = {name: name for name in (ROBOT_JOINT, *WHEEL_JOINTS)}
        joints |= {thing_name(now): thing_name(then) for now, then in same.items()}
        for now, then in joints.items():
            data.joint(now).qpos[:] = self.data.joint(then).qpos
        for index, walk in walks.items():
            data.mocap_pos[_mocap(model, index), :2] = walk.place()
        mujoco.mj_forward(model, data)
        return data

    def _step_once(self) -> None:
        self._drive = diff_drive.step(self._drive, self._command, TIMESTEP_S, self._config)
        self._command = None
        self.data.ctrl[: len(WHEEL_JOINTS)] = 2 * diff_drive.wheel_speeds(self._drive.velocity, self._config)
        self._walk()
        before = self.data.qpos.copy()
        mujoco.mj_step(self.model, self.data)
        if not np.abs(self.data.qvel).max() < _WILD_SPEED:  # also true for NaN
            _log.warning("the simulation has become unstable at %.2f s; everything stops", self._steps * TIMESTEP_S)
            self.data.qpos[:] = before
            self._stop()
        turned = self.data.qpos[self._wheel_angles] - before[self._wheel_angles]
        self._odometry = diff_drive.integrate(self._odometry, *_sides(turned), self._config)
        self._count_collisions()

    def _walk(self) -> None:
        """Move the things with a route by one step."""
        robot = self.data.qpos[self._pose_at : self._pose_at + 2]
        for index, walk in self._walks.items():
            self.data.mocap_pos[_mocap(self.model, index), :2] = walk.step(TIMESTEP_S, robot)

    def _stop(self) -> None:
        self._drive = DriveState()
        self.data.ctrl[:] = 0
        self.data.qvel[:] = 0
        self.data.qacc_warmstart[:] = 0
        mujoco.mj_forward(self.model, self.data)

    def _state(self) -> RobotState:
        speeds = self.data.qvel[self._wheel_speeds]
        velocity = diff_drive.velocity_of(*_sides(speeds), self._config)
        return RobotState(
            time_s=self._steps * TIMESTEP_S,
            odometry=self._odometry,
            linear_mps=velocity.linear_mps,
            angular_radps=velocity.angular_radps,
            joint_positions=dict(zip(WHEEL_JOINTS, self.data.qpos[self._wheel_angles].tolist(), strict=True)),
            joint_velocities=dict(zip(WHEEL_JOINTS, speeds.tolist(), strict=True)),
            truth=self._truth(),
            contacts=tuple(name for name, until in self._touched_until.items() if until > self._steps),
            collisions=self._collisions,
        )

    def _truth(self) -> Pose2D:
        x, y, _, qw, qx, qy, qz = self.data.qpos[self._pose_at : self._pose_at + 7].tolist()
        return Pose2D(x, y, float(np.arctan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))))

    def _count_collisions(self) -> None:
        for name in self._contacts.touched(self.data):
            if self._touched_until.get(name, 0) <= self._steps:
                self._collisions += 1
            self._touched_until[name] = self._steps + round(_TOUCH_S / TIMESTEP_S)

    def _thing_pose(self, index: int) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
        if self.world.obstacles[index].movable:
            start = int(self.model.joint(thing_name(index)).qposadr[0])
            x, y, z, qw, qx, qy, qz = self.data.qpos[start : start + 7].tolist()
        elif index in self._walks:
            body = self.data.body(thing_name(index))
            (x, y, z), (qw, qx, qy, qz) = body.xpos.tolist(), body.xquat.tolist()
        else:
            geom = self.model.geom(thing_name(index))
            (x, y, z), (qw, qx, qy, qz) = geom.pos.tolist(), geom.quat.tolist()
        return (x, y, z), (qx, qy, qz, qw)


def _mocap(model: mujoco.MjModel, index: int) -> int:
    """Return the number of the thing with a route among the bodies that MuJoCo does not move."""
    return int(model.body(thing_name(index)).mocapid[0])


def _sides(wheels: NDArray[np.float64]) -> tuple[float, float]:
    """Return the means of the left and the right wheels; ``wheels`` is (4,), as WHEEL_JOINTS."""
    front_left, front_right, rear_left, rear_right = wheels.tolist()
    return (front_left + rear_left) / 2, (front_right + rear_right) / 2


def _at_start(name: str) -> str:
    return f"position of obstacle {name!r} overlaps the robot, which starts at 0, 0; keep 0.35 m around it free"


def _touched_at_start(model: mujoco.MjModel, world: World) -> list[str]:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return Contacts(model, world).touched(data)
