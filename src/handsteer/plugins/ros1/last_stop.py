"""A Stop that outlives the master, with which all nodes that remember it end in the same moment."""

import logging
import os
import re
from pathlib import Path

import rospkg

log = logging.getLogger(__name__)


class LastStop:
    """A file, in ROS's home folder, that exists while a node waits for its master to come back with a Stop in force.

    Args:
        uri: Address of the master.
        node: Full name of the node.
    """

    def __init__(self, uri: str, node: str) -> None:
        self._file = Path(rospkg.get_ros_home(), f"handsteer_stopped_{re.sub(r'[^0-9A-Za-z]+', '_', uri + node)}")

    def keep(self) -> None:
        """Remember the Stop; one that cannot be written is logged."""
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            self._file.touch()
        except OSError as error:
            log.warning("the Stop cannot be kept until the master is back: %s", error)

    def take(self) -> bool:
        """Return whether a Stop was kept; once, unless its file cannot be removed."""
        try:
            self._file.unlink()
        except FileNotFoundError:
            return False
        except OSError as error:
            log.warning("a Stop that was kept cannot be removed: %s", error)
            return os.path.exists(self._file)  # noqa: PTH110 - False also where the folder cannot be read
        return True
