"""Things in the world that walk along a route, such as people."""

import math

import numpy as np
from numpy.typing import NDArray

from handsteer.robots.world import Thing, World

# The robot is in the way if it is so near, from middle to middle, and within 60 degrees of the way.
_POLITE_M, _AHEAD, _WAITS_S = 0.9, 0.5, 2.0
_STEP_M = 0.01


class Walk:
    """Where a thing with a route is: it goes from its place along the route, and back again.

    If the robot is in its way, less than 0.9 m ahead from middle to middle, it stands for two seconds, and turns round.

    Args:
        thing: The thing.
    """

    def __init__(self, thing: Thing) -> None:
        self._points = np.array([thing.position, *thing.route])
        self._ends_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self._points, axis=0), axis=1))])
        self._speed_mps = thing.speed
        self._gone_m = self._waits_s = 0.0
        self._way = 1.0

    def place(self, more_m: float = 0.0) -> NDArray[np.float64]:
        """Return (2,) x and y now, or ``more_m`` further on its way."""
        gone_m = self._gone_m + self._way * more_m
        return np.array([np.interp(gone_m, self._ends_m, self._points[:, axis]) for axis in range(2)])

    def step(self, dt_s: float, robot: NDArray[np.float64]) -> NDArray[np.float64]:
        """Advance time by ``dt_s`` seconds and return (2,) x and y; ``robot`` is (2,) the robot's place."""
        here = self.place()
        if self._waits_s > 0.0:
            self._waits_s -= dt_s
            if self._waits_s <= 0.0:
                self._way = -self._way
            return here
        to, way = robot - here, self.place(_STEP_M) - here
        if math.hypot(*to) < _POLITE_M and np.dot(to, way) > _AHEAD * math.hypot(*to) * math.hypot(*way):
            self._waits_s = _WAITS_S
            return here
        self._gone_m += self._way * self._speed_mps * dt_s
        if not 0.0 <= self._gone_m <= self._ends_m[-1]:
            self._gone_m = min(max(self._gone_m, 0.0), float(self._ends_m[-1]))
            self._way = 1.0 if self._gone_m == 0.0 else -1.0
        return self.place()


def walks_in(world: World) -> dict[int, Walk]:
    """Return the walk of each thing of ``world`` that has a route, by its index."""
    return {index: Walk(thing) for index, thing in enumerate(world.obstacles) if thing.route}
