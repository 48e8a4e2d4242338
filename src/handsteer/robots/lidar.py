"""The laser scanner of the simulated robot: rays in MuJoCo, in the plane of the scanner."""

import math

import mujoco
import numpy as np

from handsteer.robots.description import joints
from handsteer.robots.physics import ROBOT_JOINT, THINGS_GROUP
from handsteer.robots.protocol import RangeScan

SCAN_LINK = "base_scan"
"""The scanner's link in the robot description."""

RAYS = 360
RANGE_MIN_M = 0.05
RANGE_MAX_M = 8.0

_INCREMENT = math.tau / RAYS
# MuJoCo 3.5 and newer can also return the normals.
_EXTRAS = {"normal": None} if "normal" in (mujoco.mj_multiRay.__doc__ or "") else {}


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
        (mount,) = (joint for joint in joints(urdf) if joint.child == SCAN_LINK)
        self._place = np.array(mount.xyz)
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
