"""Obstacles and gates of a map, from the markers of a world."""

import math
from itertools import islice
from typing import Any

from handsteer.messages import MarkerArray, yaw_of
from handsteer.nodes.world_markers import GATES
from handsteer.replay.drive_facts import Thing

_MOST = 2000
_BOX, _SPHERE, _CYLINDER = 1, 2, 3
_ADD, _DELETE, _DELETE_ALL = 0, 2, 3
_FARTHEST_M = 1e5


class MapThings:
    """The things that the markers so far have left on the map; those of other shapes than boxes and discs are not."""

    def __init__(self) -> None:
        self._things: dict[tuple[str, int], Thing] = {}

    def note(self, message: MarkerArray) -> None:
        """Add, change or remove things."""
        for marker in islice(message.markers, _MOST):
            key = (marker.ns, marker.id)
            thing = _thing(marker) if marker.action == _ADD else None
            if marker.action == _DELETE_ALL:
                self._things.clear()
            elif thing is not None and (key in self._things or len(self._things) < _MOST):
                self._things[key] = thing
            elif marker.action == _DELETE:
                self._things.pop(key, None)

    def all(self) -> list[Thing]:
        """Return all things, obstacles before gates."""
        return sorted(self._things.values(), key=lambda thing: thing.kind == "gate")


def _thing(marker: Any) -> Thing | None:
    position, scale, colour = marker.pose.position, marker.scale, marker.color
    yaw = yaw_of(marker.pose.orientation)
    numbers = (position.x, position.y, yaw, scale.x, scale.y, colour.r, colour.g, colour.b)
    if not all(math.isfinite(number) and abs(number) < _FARTHEST_M for number in numbers):
        return None
    if marker.type not in (_BOX, _SPHERE, _CYLINDER):
        return None
    kind = "gate" if marker.ns == GATES else "box" if marker.type == _BOX else "disc"
    red, green, blue = (round(255 * max(0.0, min(part, 1.0))) for part in (colour.r, colour.g, colour.b))
    return Thing(kind, position.x, position.y, yaw, scale.x, scale.y, (red, green, blue))
