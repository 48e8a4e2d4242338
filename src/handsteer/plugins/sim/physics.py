"""The MuJoCo model of the robot in its world, and the contact of its wheels with the floor.

A robot with four fixed wheels can turn only by scrubbing: when it turns in place at w, each wheel slides sideways at
0.2 m * w. The effect on the turn depends on the contact:

* With the same friction in all directions, the sliding takes grip from the wheels: this robot then turns by 30 to 56 %
  of the command. Real skid-steered robots behave like that, and their drivers enlarge ``wheel_separation`` for it; with
  this robot's dimensions, its path would never match its odometry.
* A sliding contact in MuJoCo also lifts off (its friction cone is convex), so that the robot rattles.

Therefore the two directions are separate. Each wheel has a *tread*, a narrow capsule that touches only the floor.
MuJoCo aligns the friction axes of a capsule on a plane with the capsule, so the tread grips along (1.0) and hardly
across (0.01). Across, one force on the whole robot opposes its sideways speed, up to 0.6 of its weight: it keeps the
robot on its curve without hindering the turn. It also acts on a robot that has left the floor, which should not happen.

A turn in place then reaches 98.8 to 99.5 % of the command and a straight drive 99.9 %; a circle of 6 m at 1 m/s and 1
rad/s ends 6 cm from its odometry. Above v * w = 6 m/s² the robot skids outwards.

The cylindrical wheels of the URDF touch only obstacles.
"""

import logging
import math
import xml.etree.ElementTree as ET

import mujoco
import numpy as np

from handsteer.errors import WorldError
from handsteer.robots import RangeScan, Shape
from handsteer.robots.world import Thing, World

_log = logging.getLogger(__name__)

WHEEL_JOINTS = ("front_left_wheel_joint", "front_right_wheel_joint", "rear_left_wheel_joint", "rear_right_wheel_joint")
"""The order of the model's actuators, before that of the scrub force."""

ROBOT_JOINT = "robot"
"""The free joint of the robot's ``base_link``."""

TIMESTEP_S = 0.01
"""One step of the physics and of the controller: 100 Hz, as ros2_control's controller manager. Half of it changes a
straight drive by 0.1 ‰ and a turn by 1 %."""

_GRAVITY_MPS2 = 9.81

THINGS_GROUP = 1
"""The group of the geoms of obstacles; all others are in group 0."""

# Narrow, because with two points further apart, MuJoCo would let each tread resist the turn.
_TREAD_HALF_WIDTH_M = 0.002
_GRIP_ALONG = 1.0
_GRIP_ACROSS = 0.01
_SCRUB = 0.6
_SCRUB_NS_PER_M = 200.0
# A wheel that gripped a wall would climb it.
_GRIP_ON_THINGS = 0.1

# A velocity servo. Its gain * timestep must not exceed the inertia of wheel and motor (0.0005 + 0.0015): above, it
# works against the contact solver and the robot rocks (measured at 46 times: a straight drive 9 % too long).
_SERVO_NMS_PER_RAD = 0.2
_ROTOR_INERTIA_KGM2 = 0.0015
# Less than the grip of a wheel (0.33 N m), so that a wall stalls the wheels: wheels that spin make the robot hop.
_MOTOR_TORQUE_NM = 0.2

# N s/m and N m s/rad per kg: a ball of 0.2 m radius loses half of its speed in a second.
_ROLLING_DAMPING_PER_S = 0.03

# Contact masks: two geoms touch if the contype of one shares a bit with the conaffinity of the other.
_FLOOR, _THINGS, _ALL, _NOBODY = 1, 2, 3, 0

_SHAPES: dict[Shape, mujoco.mjtGeom] = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
}

SCAN_LINK = "base_scan"
"""The scanner's link in the robot description."""

RAYS = 360
RANGE_MIN_M = 0.05
RANGE_MAX_M = 8.0

_INCREMENT = math.tau / RAYS
# MuJoCo 3.5 and newer can also return the normals.
_EXTRAS = {"normal": None} if "normal" in (mujoco.mj_multiRay.__doc__ or "") else {}


def thing_name(index: int) -> str:
    """Return the name of the geom, and of the joint, of obstacle number ``index`` of the world in the model."""
    return f"obstacle {index}"


def compile_model(urdf: str, world: World) -> mujoco.MjModel:
    """Return the model of the robot of ``urdf`` at the origin of ``world``.

    Raises:
        WorldError: MuJoCo refuses the robot description or the world.
    """
    # By default, MuJoCo prints its warnings and writes them into a file in the working directory.
    mujoco.set_mju_user_warning(_log.warning)
    try:
        spec = mujoco.MjSpec.from_string(urdf)
        _set_options(spec)
        _let_robot_move(spec)
        _add_floor(spec)
        for name in WHEEL_JOINTS:
            _add_wheel(spec, name)
        _add_scrub(spec)
        for index, thing in enumerate(world.obstacles):
            _add_thing(spec, thing_name(index), thing)
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise WorldError(f"the simulator refuses the robot or its world: {' '.join(str(error).split())}") from None
    _let_things_rest(model, world)
    return model


def _set_options(spec: mujoco.MjSpec) -> None:
    spec.option.timestep = TIMESTEP_S
    spec.option.gravity = [0.0, 0.0, -_GRAVITY_MPS2]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
    # The caller must see a state that diverges, instead of a reset to the initial one.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    # Things at rest cost nothing until they are touched; older versions of MuJoCo lack this.
    spec.option.enableflags |= getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0)


def _let_robot_move(spec: mujoco.MjSpec) -> None:
    spec.body("base_link").add_freejoint(name=ROBOT_JOINT)
    for body in spec.bodies:
        is_wheel = any(joint.name in WHEEL_JOINTS for joint in body.joints)
        for geom in body.geoms:
            geom.contype = _THINGS if is_wheel else _ALL
            geom.conaffinity = _NOBODY
            if is_wheel:
                geom.priority = 1
                geom.friction[0] = _GRIP_ON_THINGS


def _add_floor(spec: mujoco.MjSpec) -> None:
    spec.worldbody.add_geom(
        name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1], contype=_NOBODY, conaffinity=_FLOOR
    )


def _add_wheel(spec: mujoco.MjSpec, name: str) -> None:
    joint = spec.joint(name)
    joint.armature = _ROTOR_INERTIA_KGM2
    wheel = joint.parent
    tread = wheel.add_geom(
        name=f"{name} tread",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        size=[wheel.geoms[0].size[0], _TREAD_HALF_WIDTH_M, 0],
        quat=[math.sqrt(0.5), math.sqrt(0.5), 0, 0],
        mass=0,
        contype=_NOBODY,
        conaffinity=_NOBODY,
    )
    contact = spec.add_pair(geomname1="floor", geomname2=tread.name, condim=3)
    contact.friction[:2] = _GRIP_ACROSS, _GRIP_ALONG
    motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.gainprm[0] = _SERVO_NMS_PER_RAD
    _damp(motor, _SERVO_NMS_PER_RAD, _MOTOR_TORQUE_NM)


def _add_scrub(spec: mujoco.MjSpec) -> None:
    robot_kg = sum(body.mass for body in spec.bodies)
    site = spec.body("base_link").add_site(name="scrub")
    scrub = spec.add_actuator(name=site.name, target=site.name, trntype=mujoco.mjtTrn.mjTRN_SITE)
    scrub.gear[:2] = 0, 1
    scrub.gainprm[0] = 0
    _damp(scrub, _SCRUB_NS_PER_M, _SCRUB * robot_kg * _GRAVITY_MPS2)


def _damp(actuator: mujoco.MjsActuator, damping: float, limit: float) -> None:
    """Let ``actuator`` oppose velocity, with a force or torque of at most ``limit``."""
    actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    actuator.biasprm[2] = -damping
    actuator.forcelimited = True
    actuator.forcerange = [-limit, limit]


def _add_thing(spec: mujoco.MjSpec, name: str, thing: Thing) -> None:
    x, y, z = thing.extent
    pose = {
        "pos": [*thing.position, z / 2],
        "quat": [math.cos(thing.yaw / 2), 0, 0, math.sin(thing.yaw / 2)],
    }
    shape = {
        "type": _SHAPES[thing.shape],
        "size": [x / 2, z / 2, 0] if thing.shape == "cylinder" else [x / 2, y / 2, z / 2],
        "contype": _ALL,
        "conaffinity": _ALL,
        "group": THINGS_GROUP,
    }
    if not thing.movable and not thing.route:
        spec.worldbody.add_geom(name=name, **shape, **pose)
        return
    body = spec.worldbody.add_body(name=name, mocap=bool(thing.route), **pose)
    if thing.route:
        body.add_geom(name=name, **shape)
        return
    body.add_freejoint(name=name)
    geom = body.add_geom(name=name, mass=thing.mass, **shape)
    geom.friction[0] = 0.5


def _let_things_rest(model: mujoco.MjModel, world: World) -> None:
    """Damp rolling things without additional contacts."""
    for index, thing in enumerate(world.obstacles):
        if thing.movable:
            start = int(model.joint(thing_name(index)).dofadr[0])
            model.dof_damping[start : start + 6] = _ROLLING_DAMPING_PER_S * thing.mass


class Lidar:
    """Measures the distances of obstacles: one ray per degree, the first straight back, then counterclockwise.

    It sees obstacles that reach up to its own height, but neither the robot nor the floor. There is no noise.

    Args:
        model: Model of the robot in its world.
        urdf: Contains the pose of the scanner on the robot.
    """

    def __init__(self, model: mujoco.MjModel, urdf: str) -> None:
        self._model = model
        self._body = int(model.jnt_bodyid[model.joint(ROBOT_JOINT).id])
        (mount,) = ET.fromstring(urdf).iterfind(f"joint/child[@link='{SCAN_LINK}']/../origin")
        self._place = np.array(mount.get("xyz", "").split(), np.float64)
        angles = -math.pi + _INCREMENT * np.arange(RAYS)
        self._rays = np.stack([np.cos(angles), np.sin(angles), np.zeros(RAYS)], axis=1)
        self._seen = np.zeros(6, np.uint8)
        self._seen[THINGS_GROUP] = 1
        self._geoms = np.zeros(RAYS, np.int32)
        self._distances = np.zeros(RAYS)

    def scan(self, data: mujoco.MjData) -> RangeScan:
        """Return a scan of the state ``data``."""
        turn = data.xmat[self._body].reshape(3, 3)
        mujoco.mj_multiRay(
            m=self._model,
            d=data,
            pnt=data.xpos[self._body] + turn @ self._place,
            vec=(self._rays @ turn.T).reshape(-1),
            geomgroup=self._seen,
            flg_static=True,
            bodyexclude=self._body,
            geomid=self._geoms,
            dist=self._distances,
            nray=RAYS,
            cutoff=RANGE_MAX_M,
            **_EXTRAS,
        )
        found = self._distances
        # As in REP 117. MuJoCo returns -1 for a ray that hits nothing.
        ranges = np.where((found < 0) | (found > RANGE_MAX_M), np.inf, np.where(found < RANGE_MIN_M, -np.inf, found))
        return RangeScan(-math.pi, _INCREMENT, RANGE_MIN_M, RANGE_MAX_M, ranges.astype(np.float32))
