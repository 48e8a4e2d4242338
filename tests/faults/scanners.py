"""Rows of a laser scanner that fails, while the control slows the robot before what it sees."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from handsteer.config import CollisionMonitorConfig, RobotConfig
from handsteer.messages import SCAN
from handsteer.nodes.base import Node
from handsteer.nodes.control import HandSignControlNode
from handsteer.robots import RangeScan, Robot
from handsteer.testing.fault_transport import CUT, FROZEN, LinkFault
from tests.faults.base import Base
from tests.faults.chain import Chain
from tests.faults.row import Row, lower_the_hand, nothing

RAYS = 360
FREE = RangeScan(-math.pi, math.tau / RAYS, 0.05, 8.0, np.full(RAYS, 7.0, np.float32))


class ScannedChain(Chain):
    """The chain with a scanner in a hall without obstacles, and a control that listens to it."""

    def _driven(self) -> Robot:
        self.base = self.scanner = ScannedBase(self.clock, RobotConfig())
        return self.base

    def _control(self) -> Node:
        rule = CollisionMonitorConfig(enabled=True)
        return HandSignControlNode(self.faults, self.clock, self.limits(), collision_monitor=rule, arming=True)


class ScannedBase(Base):
    """The robot's base with a scanner.

    Attributes:
        sees: What that gives; None for nothing.
    """

    sees: RangeScan | None = FREE

    def scan(self) -> RangeScan | None:
        return self.sees


def scanners() -> Iterator[Row]:
    """Return all of them."""
    yield from _links()
    for words, sees, leaves in (
        ("the scanner stops", None, False),
        ("the scanner gives NaN", _with(math.nan), False),
        ("the scanner gives 0", _with(0.0), False),
        ("the scanner gives no rays", replace(FREE, ranges=FREE.ranges[:0]), False),
        ("the scanner's angles are NaN", replace(FREE, angle_increment=math.nan), False),
        ("the scanner stamps scans 5 s back", replace(FREE, age_s=5.0), False),
        ("the scanner stamps scans 5 s ahead; then the driver stops", replace(FREE, age_s=-5.0), True),
        ("the scanner repeats one scan", _room(), False),
        ("the scanner gives NaN for two thirds of its rays; then the driver stops", _with_gaps(), True),
    ):
        yield _row(words, _shows(sees), _shows(FREE), leaves=leaves)


def _links() -> Iterator[Row]:
    for words, fault, leaves in (
        ("no messages", CUT, False),
        ("half the messages are lost; then the driver stops", LinkFault(drop=0.5), True),
        ("delayed by 1 s", LinkFault(delay_s=1.0), False),
        ("delayed by 0 to 0.3 s; then the driver stops", LinkFault(jitter_s=0.3), True),
        ("reordered; then the driver stops", LinkFault(reorder=0.5), True),
        ("frozen, then all messages at once", FROZEN, False),
    ):

        def begin(chain: Chain, fault: LinkFault = fault) -> None:
            chain.faults.spoil(SCAN, fault)

        yield _row(words, begin, lambda chain: chain.faults.heal(SCAN), leaves=leaves)


def _row(words: str, begin: Callable[[Chain], None], end: Callable[[Chain], None], *, leaves: bool) -> Row:
    return Row(SCAN.name, words, begin, end, lower_the_hand if leaves else nothing, make=ScannedChain)


def _shows(sees: RangeScan | None) -> Callable[[Chain], None]:
    def show(chain: Chain) -> None:
        assert isinstance(chain, ScannedChain)
        chain.scanner.sees = sees

    return show


def _with(metres: float) -> RangeScan:
    return replace(FREE, ranges=np.full(RAYS, metres, np.float32))


def _room() -> RangeScan:
    """Return what a room looks like: walls 3 m ahead and 2 m to the sides"""
    angles = FREE.angle_min + np.arange(RAYS) * FREE.angle_increment
    walls = np.minimum(3.0 / np.maximum(np.abs(np.cos(angles)), 1e-6), 2.0 / np.maximum(np.abs(np.sin(angles)), 1e-6))
    return replace(FREE, ranges=np.minimum(walls, 7.0).astype(np.float32))


def _with_gaps() -> RangeScan:
    ranges = np.full(RAYS, np.nan, np.float32)
    ranges[::3] = 7.0
    return replace(FREE, ranges=ranges)
