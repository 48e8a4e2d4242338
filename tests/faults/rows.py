"""Every node and every topic, with every fault that can be had in stepped time: the rows of the table."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from handsteer.messages import (
    CMD_VEL,
    HAND_SIGN,
    IMAGE_RAW,
    STEERING_CMD_VEL,
    STOP,
    Odometry,
    Topic,
    TwistWithCovariance,
    twist,
)
from handsteer.testing.fault_transport import CUT, FROZEN, LinkFault
from handsteer.testing.faulty_camera import CameraFault
from tests.faults.chain import NO_COVARIANCE, REAL_CMD_VEL, REAL_ODOM, SPEED_MPS, Chain, RealRobot, RemoteChain
from tests.faults.others import others
from tests.faults.row import Act, Row, ended, frozen, killed, lower_the_hand, made, nothing, unfrozen
from tests.faults.scanners import scanners
from tests.faults.second import seconds


def rows() -> list[Row]:
    """Return all rows."""
    return [
        *_cameras(),
        *_links(),
        *_nodes(),
        *_clocks(),
        *others(),
        *seconds(),
        *_stops(),
        *_real_robots(),
        *scanners(),
    ]


_CAMERA: dict[CameraFault, tuple[str, bool]] = {
    "black": ("gives black pictures", False),
    "frozen": ("repeats one picture", False),
    "torn": ("gives truncated pictures; then the hand is lowered", True),
    "slow": ("gives one picture a second", False),
    "stuttering": ("gives pictures for a second, none for a second", False),
    "silent": ("gives no pictures", False),
    "vanishing": ("is unplugged", False),
    "in_the_future": ("stamps pictures 5 s ahead", False),
    "late": ("gives pictures that are 5 s old", False),
}


def _cameras() -> Iterator[Row]:
    for fault, (words, leaves) in _CAMERA.items():

        def begin(chain: Chain, fault: CameraFault = fault) -> None:
            chain.camera.fail(fault)

        def end(chain: Chain) -> None:
            chain.camera.recover()
            chain.run(2.0)  # one that was lost is looked for again now and then

        yield Row("camera", words, begin, end, lower_the_hand if leaves else nothing)


_LINKS: dict[str, tuple[LinkFault, bool]] = {
    "no messages": (CUT, False),
    "half the messages are lost": (LinkFault(drop=0.5), True),
    "delayed by 1 s": (LinkFault(delay_s=1.0), False),
    "delayed by 0 to 0.3 s": (LinkFault(jitter_s=0.3), True),
    "duplicated": (LinkFault(duplicate=1.0), True),
    "reordered": (LinkFault(reorder=0.5), True),
    "frozen, then all messages at once": (FROZEN, False),
}
_TOPICS: tuple[Topic[Any], ...] = (IMAGE_RAW, HAND_SIGN, CMD_VEL, STEERING_CMD_VEL)


def _links() -> Iterator[Row]:
    for topic in _TOPICS:
        for words, (fault, leaves) in _LINKS.items():

            def begin(chain: Chain, topic: Topic[Any] = topic, fault: LinkFault = fault) -> None:
                chain.faults.spoil(topic, fault)

            def end(chain: Chain, topic: Topic[Any] = topic) -> None:
                chain.faults.heal(topic)

            words_too = f"{words}; then the driver stops" if leaves else words
            ends = lower_the_hand if leaves else nothing
            by_stick = topic is STEERING_CMD_VEL
            yield Row(topic.name, words_too, begin, end, ends, by_stick=by_stick)
            if fault is CUT:
                yield Row(topic.name, f"{words} for 1 s", begin, end, ends, by_stick=by_stick, lasts_s=1.0)


def _nodes() -> Iterator[Row]:
    for name in ("camera", "recognition", "control", "robot", "steering"):
        by_stick = name == "steering"
        # Whoever steered has to take the wheel again on the new page.
        anew = "; its page reloads" if by_stick else ""
        soon = "killed, started again 0.3 s later"
        lets_go = name == "camera"

        def kill_and_make(chain: Chain, name: str = name) -> None:
            chain.kill(name)
            chain.run(0.3)
            made(name)(chain)

        yield Row(name, "frozen for 2 s", frozen(name), unfrozen(name), by_stick=by_stick)
        yield Row(name, f"killed, started again 2 s later{anew}", killed(name), made(name), by_stick=by_stick)
        yield Row(
            name,
            f"{soon}; then the driver stops" if lets_go else f"{soon}{anew}",
            kill_and_make,
            end_reason=lower_the_hand if lets_go else nothing,
            by_stick=by_stick,
        )
        yield Row(name, f"ended, started again 2 s later{anew}", ended(name), made(name), by_stick=by_stick)


def _clocks() -> Iterator[Row]:
    def jump(chain: Chain) -> None:
        chain.clock.advance(5.0)

    yield Row("all nodes", "the machine sleeps for 5 s", jump)


def _stops() -> Iterator[Row]:
    for words, fault in (
        ("half the messages are lost", LinkFault(drop=0.5)),
        ("duplicated", LinkFault(duplicate=1.0)),
        ("reordered", LinkFault(reorder=0.5)),
        ("delayed by 0 to 0.3 s", LinkFault(jitter_s=0.3)),
    ):

        def halt(chain: Chain, fault: LinkFault = fault) -> None:
            chain.faults.spoil(STOP, fault)
            chain.steering.halt()

        def reset(chain: Chain) -> None:
            chain.faults.heal(STOP)
            chain.run(0.4)  # what is under way says Stop, too
            chain.steering.reset()

        yield Row(STOP.name, f"Stop from the page; {words}", halt, reset)
    for name in ("control", "recognition", "camera", "robot", "steering"):

        def stop_and_kill(chain: Chain, name: str = name) -> None:
            chain.say_stop(stop=True)
            chain.run(0.1)
            chain.kill(name)

        def make(chain: Chain, name: str = name) -> None:
            chain.make(name)

        yield Row(
            STOP.name,
            f"Stop, published once; the {name} is killed and started again",
            stop_and_kill,
            make,
            is_for_good=True,
        )


def _real_robots() -> Iterator[Row]:
    def cut(topic: Topic[Any]) -> tuple[Act, Act]:
        return (lambda chain: chain.faults.spoil(topic, CUT)), (lambda chain: chain.faults.heal(topic))

    yield Row("real robot", "its commands are lost", *cut(REAL_CMD_VEL), make=RemoteChain)
    yield Row("real robot", "its commands are lost for 1 s", *cut(REAL_CMD_VEL), lasts_s=1.0, make=RemoteChain)
    yield Row("real robot", "its odometry is lost", *cut(REAL_ODOM), make=RemoteChain)

    def leave(chain: Chain) -> None:
        chain.domain.kill("real_robot")

    def come_back(chain: Chain) -> None:
        assert isinstance(chain, RemoteChain)
        chain.real = RealRobot(chain)

    yield Row("real robot", "is switched off, and on again later", leave, come_back, make=RemoteChain)

    yield from _lies()
    for words, begin, end in (
        ("the node in front of it is frozen", frozen("robot"), unfrozen("robot")),
        ("the node in front of it is killed, started again later", killed("robot"), made("robot")),
        ("the control in front of it is killed, started again later", killed("control"), made("control")),
    ):
        yield Row("real robot", words, begin, end, make=RemoteChain)


def _lies() -> Iterator[Row]:
    def truth(chain: Chain) -> None:
        _robot(chain).lies = lambda odometry: odometry

    def repeats(chain: Chain) -> None:
        heard: list[Odometry] = []

        def last(odometry: Odometry) -> Odometry:
            heard.append(odometry)
            return heard[0]

        _robot(chain).lies = last

    for words, speed in (
        ("NaN in its odometry", lambda _: math.nan),
        ("in its odometry that it stands", lambda _: 0.0),
        ("in its odometry that it goes the other way", lambda real: -real),
        ("ten times its speed; then the driver stops", lambda real: 10.0 * real),
        ("that it moves whatever it does; then the driver stops", lambda _: SPEED_MPS),
    ):

        def lie(chain: Chain, speed: Callable[[float], float] = speed) -> None:
            _robot(chain).lies = lambda odometry: _with_speed(odometry, speed(odometry.twist.twist.linear.x))

        leaves = "then" in words
        yield Row("real robot", f"reports {words}", lie, truth, lower_the_hand if leaves else nothing, make=RemoteChain)
    yield Row("real robot", "repeats its last odometry", repeats, truth, make=RemoteChain)


def _robot(chain: Chain) -> RealRobot:
    assert isinstance(chain, RemoteChain)
    assert chain.real is not None
    return chain.real


def _with_speed(odometry: Odometry, speed_mps: float) -> Odometry:
    return replace(odometry, twist=TwistWithCovariance(twist(speed_mps, 0.0), NO_COVARIANCE))
