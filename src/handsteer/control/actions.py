"""Actions of signs that plug-ins bring: made once, and never the reason that a robot drives on."""

import logging
from collections.abc import Iterable

from handsteer import doors
from handsteer.errors import PLUGIN_FAILURES, PluginError
from handsteer.types import ACTIONS, Velocity

log = logging.getLogger(__name__)


class AddedActions:
    """The actions of plug-ins that a configuration names."""

    def __init__(self) -> None:
        self._made: dict[str, doors.SignAction] = {}
        self._failed: set[tuple[str, type[BaseException]]] = set()

    def make(self, actions: Iterable[str]) -> None:
        """Make those of ``actions`` that are new here and not built in; they are kept from then on.

        Raises:
            PluginError: One is not installed, or cannot be made.
        """
        for name in sorted(set(actions) - set(ACTIONS) - self._made.keys()):
            make = doors.ACTIONS.load(name)
            try:
                self._made[name] = make()
            except PLUGIN_FAILURES as error:
                reason = f"{type(error).__name__}: {error}"
                raise PluginError(f"{doors.ACTIONS.described(name)} cannot be made: {reason}") from error

    def velocity(self, name: str, now: Velocity, since_last_s: float) -> Velocity | None:
        """Return the velocity that the action ``name`` wants; None if it fails, which is logged once for each cause.

        The other arguments are the action's.
        """
        try:
            wanted = self._made[name].velocity(now, since_last_s)
            return wanted if wanted.is_finite else None
        except PLUGIN_FAILURES as error:
            if (name, type(error)) not in self._failed:
                self._failed.add((name, type(error)))
                log.exception("the action %s has failed: the robot stops", name)
            return None
