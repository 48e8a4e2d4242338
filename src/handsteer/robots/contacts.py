"""What the robot touches in a MuJoCo model."""

import mujoco
import numpy as np

from handsteer.robots.physics import ROBOT_JOINT, thing_name
from handsteer.robots.world import World


class Contacts:
    """Tells the obstacles that the robot touches.

    Args:
        model: Of the robot in ``world``.
        world: Gives the obstacles their names.
    """

    def __init__(self, model: mujoco.MjModel, world: World) -> None:
        self._names = [thing.name for thing in world.obstacles]
        # For each geom the index of the obstacle that it is, or -1; and whether it is a part of the robot.
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
