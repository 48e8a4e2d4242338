"""One node of a graph of several processes: how it is constructed, joins, and ends."""

import importlib
import logging
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any

from handsteer import doors, making
from handsteer.audit import setting_changes
from handsteer.cli import signals
from handsteer.cli.running import exit_code, freeze_loaded_objects, say, set_up_logging, settings, signals_ignored
from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.nodes.base import Node
from handsteer.parameters import NodeParameters, from_parameters
from handsteer.transports import join
from handsteer.transports.base import Session, Transport

_LOOK_PERIOD_S = 0.5

log = logging.getLogger(__name__)


def _served(node: Any, config: Config) -> AbstractContextManager[None]:
    served: AbstractContextManager[None] = doors.COMPANIONS.load("page_of_node")(node, config, say)
    return served


@dataclass(frozen=True)
class Job:
    """One node, as a process.

    Attributes:
        node: Default name of the node.
        section: Its own section of the configuration.
        make: Constructs the node.
        companion: Runs alongside the node.
    """

    node: str
    section: str
    make: Callable[[Config, Transport, Clock], Node]
    companion: Callable[[Any, Config], AbstractContextManager[None]] = lambda *_: nullcontext()


JOBS = {
    "camera": Job("my_camera", "camera", making.make_camera),
    "recognition": Job("hand_sign_recognition", "signs", making.make_recognition),
    "control": Job("hand_sign_control", "control", partial(making.make_control, others_keep_stop=True)),
    "robot": Job("robot", "robot", making.make_robot),
    "steering": Job("steering", "dashboard", making.make_steering, companion=_served),
}


def run_ros1(verb: str, words: Sequence[str]) -> int:
    """Run a node with ROS 1 arguments only; return the exit code."""
    set_up_logging()
    importlib.import_module(f"handsteer.nodes.{verb}")  # before signals can interrupt the import
    signals.interrupt_on_signals()
    return exit_code(lambda: run(verb, "ros1", tuple(words), lambda service: settings(None, None, service=service)))


def run(verb: str, transport: str, words: tuple[str, ...], settle: Callable[[dict[str, Any]], Config]) -> int:
    """Run a node until it ends or is interrupted; return the exit code.

    ``settle`` returns the parameters, including those from the graph.
    """
    settle({})  # report wrong input before joining the graph
    job = JOBS[verb]
    session: Session | None = None
    try:
        session = join(transport, job.node, words)
        config = settle(from_parameters(session.parameters, job.section, session.name))
        node = job.make(config, session.transport, session.clock)
        session.serve(NodeParameters(config, job.section, _audited(node, config), node.check))
        if node.is_managed:
            session.manage(node)
        session.offer(node.services)
        _run_until_end(node, session, job.companion(node, config))
    except KeyboardInterrupt:
        pass  # the usual end of a node
    finally:
        if session is not None:
            with signals_ignored():
                session.close()
    return 0


def _audited(node: Node, config: Config) -> Callable[[Config], None]:
    """Return what changes the parameters of ``node``, which begins with ``config``, and publishes the changes."""
    auditor, running = node.auditor, config

    def reconfigure(new: Config) -> None:
        nonlocal running
        before, running = running, new
        for event in setting_changes(before, new, auditor.who):
            auditor.say(event, node.clock.now())
        node.reconfigure(new)

    return reconfigure


def _run_until_end(node: Node, session: Session, companion: AbstractContextManager[None]) -> None:
    try:
        with companion:
            freeze_loaded_objects()
            node.start()
            log.info("%s is ready: %s", session.name, node.topics)
            while not (node.ended.is_set() or session.wait(_LOOK_PERIOD_S) or signals.were_raised()):
                pass
    finally:
        with signals_ignored():
            node.stop()
