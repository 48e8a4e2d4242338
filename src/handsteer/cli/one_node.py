"""One node of a graph of several processes: how it is made, joins, and ends."""

import importlib
import logging
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handsteer import making
from handsteer.cli import signals
from handsteer.cli.running import exit_code, keep_what_is_loaded, set_up_logging, settings, uninterrupted
from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.nodes.base import Node
from handsteer.parameters import NodeParameters, from_parameters
from handsteer.transports import join
from handsteer.transports.protocol import Session, Transport

_LOOK_PERIOD_S = 0.5

log = logging.getLogger(__name__)


def _alone(_node: Any, _config: Config) -> AbstractContextManager[None]:
    return nullcontext()


@dataclass(frozen=True)
class Job:
    """One node, as a process.

    Attributes:
        node: Name of the node, unless it is renamed.
        section: Its own section of the configuration.
        make: Makes the node.
        file: YAML file with parameters.
        given: Options by full name.
        shorthand: Options by short name.
        beside: What runs beside the node.
    """

    node: str
    section: str
    make: Callable[[Config, Transport, Clock], Node]
    file: Path | None = None
    given: Config | None = None
    shorthand: dict[str, Any] | None = None
    beside: Callable[[Any, Config], AbstractContextManager[None]] = _alone

    def settings(self, service: dict[str, Any] | None = None) -> Config:
        """Return the parameters; ``service`` has those of the graph."""
        return settings(self.file, self.given, self.shorthand, service=service)


_OF_ROS = {
    "camera": Job("my_camera", "camera", making.make_camera),
    "recognition": Job("hand_sign_recognition", "signs", making.make_recognition),
    "control": Job("hand_sign_control", "control", making.make_control),
    "robot": Job("robot", "robot", making.make_robot),
}


def load(verb: str) -> None:
    """Load what a node needs, before signals surface in the midst of it."""
    importlib.import_module(f"handsteer.nodes.{verb}")


def run_of_ros(verb: str, words: Sequence[str]) -> int:
    """Run one of these nodes with ROS 1's own ``words`` alone; return the exit code."""
    set_up_logging()
    load(verb)
    signals.end_in_order()
    return exit_code(lambda: run(_OF_ROS[verb], "ros1", tuple(words)))


def run(job: Job, transport: str, words: tuple[str, ...]) -> int:
    """Run a node until it ends, or is ended; return the exit code."""
    job.settings()  # what is wrong already is said before others see this node
    session: Session | None = None
    try:
        session = join(transport, job.node, words)
        config = job.settings(from_parameters(session.parameters, job.section, session.name))
        node = job.make(config, session.transport, session.clock)
        session.serve(NodeParameters(config, job.section, node.reconfigure, node.check))
        session.offer(node.services)
        _run_until_end(node, session, job.beside(node, config))
    except KeyboardInterrupt:
        pass  # the ordinary end of a node
    finally:
        if session is not None:
            with uninterrupted():
                session.close()
    return 0


def _run_until_end(node: Node, session: Session, beside: AbstractContextManager[None]) -> None:
    try:
        with beside:
            keep_what_is_loaded()
            node.start()
            log.info("%s is ready: %s", session.name, node.topics)
            while not (node.ended.is_set() or session.wait(_LOOK_PERIOD_S) or signals.were_raised()):
                pass
    finally:
        with uninterrupted():
            node.stop()
