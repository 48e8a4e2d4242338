"""Every node and every topic, with every fault that can be had in stepped time: the rows of the table."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from handsteer.images import image_message
from handsteer.messages import (
    CMD_VEL,
    HAND_SIGN,
    IMAGE_RAW,
    STEERING_CMD_VEL,
    STOP,
    Bool,
    Header,
    Image,
    String,
    Time,
    Topic,
    twist,
)
from handsteer.nodes.node import Node
from handsteer.testing.fault_transport import CUT, FROZEN, LinkFault
from handsteer.testing.faulty_camera import CameraFault
from tests.faults.chain import REAL_CMD_VEL, REAL_ODOM, SPEED_MPS, Chain, RealRobot, RemoteChain

Act = Callable[[Chain], None]


def nothing(_: Chain) -> None:
    """Do nothing."""


def lower_the_hand(chain: Chain) -> None:
    """End the reason of whoever drives: no sign, no stick."""
    chain.show()
    chain.page.holds_stick = False
    if chain.is_well("steering"):
        chain.steering.release()


@dataclass(frozen=True)
class Row:
    """A fault while the robot drives.

    Attributes:
        where: The node or topic that it befalls.
        fault: What happens, in words.
        begin: Makes it happen.
        end: Ends it.
        end_reason: Ends the reason to drive where the fault does not: the robot may drive on till then.
        by_stick: Whether the page's stick drives, and not a hand.
        lasts_s: For how long.
        is_for_good: Whether the robot has to stand even when the fault is over and neutral was seen.
        make: Builds the chain.
    """

    where: str
    fault: str
    begin: Act
    end: Act = nothing
    end_reason: Act = nothing
    by_stick: bool = False
    lasts_s: float = 2.0
    is_for_good: bool = False
    make: Callable[[], Chain] = Chain

    @property
    def name(self) -> str:
        return f"{self.where}: {self.fault}"

    @property
    def leaves_reason(self) -> bool:
        """Whether the robot may drive on during the fault, until the hand is lowered."""
        return self.end_reason is not nothing


def rows() -> list[Row]:
    """Return all rows."""
    return [*_cameras(), *_links(), *_nodes(), *_clocks(), *_values(), *_seconds(), *_stops(), *_real_robots()]


_CAMERA: dict[CameraFault, tuple[str, bool]] = {
    "black": ("gives black pictures", False),
    "frozen": ("gives one picture for ever", False),
    "torn": ("gives pictures that are cut short somewhere; then the hand is lowered", True),
    "slow": ("gives one picture a second", False),
    "stuttering": ("stops for a second, goes on for a second", False),
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
    "nothing comes": (CUT, False),
    "half is lost": (LinkFault(drop=0.5), True),
    "comes 1 s late": (LinkFault(delay_s=1.0), False),
    "comes 0 to 0.3 s late": (LinkFault(jitter_s=0.3), True),
    "comes twice": (LinkFault(duplicate=1.0), True),
    "comes in another order": (LinkFault(reorder=0.5), True),
    "stands still, then all comes at once": (FROZEN, False),
}
_TOPICS: tuple[Topic[Any], ...] = (IMAGE_RAW, HAND_SIGN, CMD_VEL, STEERING_CMD_VEL)


def _links() -> Iterator[Row]:
    for topic in _TOPICS:
        for words, (fault, leaves) in _LINKS.items():

            def begin(chain: Chain, topic: Topic[Any] = topic, fault: LinkFault = fault) -> None:
                chain.faults.spoil(topic, fault)

            def end(chain: Chain, topic: Topic[Any] = topic) -> None:
                chain.faults.heal(topic)

            words_too = f"{words}; then the driver lets go" if leaves else words
            ends = lower_the_hand if leaves else nothing
            by_stick = topic is STEERING_CMD_VEL
            yield Row(topic.name, words_too, begin, end, ends, by_stick=by_stick)
            if fault is CUT:
                yield Row(topic.name, f"{words} for 1 s", begin, end, ends, by_stick=by_stick, lasts_s=1.0)


def _nodes() -> Iterator[Row]:
    for name in ("camera", "recognition", "control", "robot", "steering"):
        by_stick = name == "steering"
        # Whoever steered has to take the wheel again on the new page.
        anew = "; its page comes anew" if by_stick else ""
        soon = "killed, started again 0.3 s later"
        lets_go = name == "camera"

        def kill_and_make(chain: Chain, name: str = name) -> None:
            chain.kill(name)
            chain.run(0.3)
            _made(name)(chain)

        yield Row(name, "frozen for 2 s", _frozen(name), _unfrozen(name), by_stick=by_stick)
        yield Row(name, f"killed, started again 2 s later{anew}", _killed(name), _made(name), by_stick=by_stick)
        yield Row(
            name,
            f"{soon}; then the driver lets go" if lets_go else f"{soon}{anew}",
            kill_and_make,
            end_reason=lower_the_hand if lets_go else nothing,
            by_stick=by_stick,
        )
        yield Row(name, f"ended, started again 2 s later{anew}", _ended(name), _made(name), by_stick=by_stick)


def _clocks() -> Iterator[Row]:
    def jump(chain: Chain) -> None:
        chain.clock.advance(5.0)

    yield Row("all nodes", "the machine sleeps for 5 s", jump)


def _values() -> Iterator[Row]:
    for word, number in (("NaN", math.nan), ("infinity", math.inf)):

        def steer(chain: Chain, number: float = number) -> None:
            chain.page.holds_stick = False
            _beat(chain, STEERING_CMD_VEL, lambda: twist(number, number))

        def command(chain: Chain, number: float = number) -> None:
            chain.freeze("control")
            _beat(chain, CMD_VEL, lambda: twist(SPEED_MPS, number))

        yield Row("/steering/cmd_vel", f"{word}, by another; then the hand is lowered", steer, _hand_and_still)
        yield Row(CMD_VEL.name, f"{word} in a part, by another; the control is frozen", command, _unfrozen("control"))
    for words, text in (
        ("an unknown word", "Dance"),
        ("an empty text", ""),
        ("a text of 100,000 letters", "F" * 10**5),
    ):

        def sign(chain: Chain, text: str = text) -> None:
            chain.freeze("recognition")
            _beat(chain, HAND_SIGN, lambda: String(data=text))
            chain.run(0.5)

        yield Row(
            HAND_SIGN.name,
            f"{words}, by another, without an end; the recognition is frozen; then it ends",
            sign,
            _unfrozen("recognition"),
            _still,
        )
    header = Header(stamp=Time(0, 0), frame_id="camera")
    whole = image_message(np.zeros((48, 64, 3), np.uint8), header)
    for words, image in (
        ("has no size", Image(header, 0, 0, "bgr8", 0, 0, np.zeros(0, np.uint8))),
        ("is cut short", Image(header, 48, 64, "bgr8", 0, 192, whole.data[:99])),
        ("has an unknown encoding", Image(header, 48, 64, "purple8", 0, 192, whole.data)),
    ):

        def picture(chain: Chain, image: Image = image) -> None:
            chain.camera.fail("silent")
            _beat(chain, IMAGE_RAW, lambda: image)

        def over(chain: Chain) -> None:
            _still(chain)
            chain.camera.recover()

        yield Row(IMAGE_RAW.name, f"every picture {words}", picture, over)


def _seconds() -> Iterator[Row]:
    def drive(chain: Chain) -> None:
        chain.show()
        chain.run(0.5)
        _beat(chain, CMD_VEL, lambda: twist(SPEED_MPS, 0.0))
        chain.run(0.5)

    yield Row(
        CMD_VEL.name, "a second publisher drives, the hand is lowered; then it falls silent", drive, end_reason=_still
    )

    def show(chain: Chain) -> None:
        chain.show()
        _beat(chain, HAND_SIGN, lambda: String(data="Forward"))

    yield Row(
        HAND_SIGN.name,
        "a second publisher says Forward, the hand is lowered; then it falls silent",
        show,
        end_reason=_still,
    )

    def frozen_beside(chain: Chain) -> None:
        last = chain.hand.read().image
        chain.show()
        stamp = chain.clock.stamp
        _beat(chain, IMAGE_RAW, lambda: image_message(last, Header(stamp(chain.clock.now()), "camera")))

    yield Row(
        IMAGE_RAW.name,
        "a second camera shows one picture of Forward for ever, the hand is lowered",
        frozen_beside,
        _still,
    )

    def contradict(chain: Chain) -> None:
        chain.steering.halt()
        _beat(chain, STOP, lambda: Bool(data=False), every_s=0.13)

    def over(chain: Chain) -> None:
        _still(chain)
        chain.steering.reset()

    yield Row(STOP.name, "Stop by the page; another says false again and again", contradict, over)


def _stops() -> Iterator[Row]:
    for words, fault in (
        ("half is lost", LinkFault(drop=0.5)),
        ("comes twice", LinkFault(duplicate=1.0)),
        ("comes in another order", LinkFault(reorder=0.5)),
        ("comes 0 to 0.3 s late", LinkFault(jitter_s=0.3)),
    ):

        def halt(chain: Chain, fault: LinkFault = fault) -> None:
            chain.faults.spoil(STOP, fault)
            chain.steering.halt()

        def reset(chain: Chain) -> None:
            chain.faults.heal(STOP)
            chain.run(0.4)  # what is under way says Stop, too
            chain.steering.reset()

        yield Row(STOP.name, f"Stop by the page; {words}", halt, reset)
    for name in ("control", "recognition", "camera", "robot", "steering"):

        def stop_and_kill(chain: Chain, name: str = name) -> None:
            chain.say_stop(stop=True)
            chain.run(0.1)
            chain.kill(name)

        def make(chain: Chain, name: str = name) -> None:
            chain.make(name)

        yield Row(
            STOP.name, f"Stop, said once; the {name} is killed and started again", stop_and_kill, make, is_for_good=True
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

    def senseless(chain: Chain) -> None:
        assert isinstance(chain, RemoteChain)
        chain.real.is_senseless = True

    def sensible(chain: Chain) -> None:
        assert isinstance(chain, RemoteChain)
        chain.real.is_senseless = False

    yield Row("real robot", "says NaN in its odometry", senseless, sensible, make=RemoteChain)
    for words, begin, end in (
        ("the node in front of it is frozen", _frozen("robot"), _unfrozen("robot")),
        ("the node in front of it is killed, started again later", _killed("robot"), _made("robot")),
        ("the control in front of it is killed, started again later", _killed("control"), _made("control")),
    ):
        yield Row("real robot", words, begin, end, make=RemoteChain)


class _Beat(Node):
    """Another program, which publishes without an end."""

    def __init__(self, chain: Chain, topic: Topic[Any], make: Callable[[], object], every_s: float) -> None:
        super().__init__("another", chain.faults, chain.clock)
        publisher = self.publisher(topic)
        self.every(every_s, lambda: publisher.publish(make()))


def _beat(chain: Chain, topic: Topic[Any], make: Callable[[], object], every_s: float = 1 / 30) -> None:
    chain.nodes["another"] = _Beat(chain, topic, make, every_s)


def _still(chain: Chain) -> None:
    if "another" in chain.nodes:
        chain.domain.kill("another")
        del chain.nodes["another"]


def _hand_and_still(chain: Chain) -> None:
    lower_the_hand(chain)
    chain.run(0.1)
    _still(chain)


def _frozen(name: str) -> Act:
    return lambda chain: chain.freeze(name)


def _unfrozen(name: str) -> Act:
    def end(chain: Chain) -> None:
        _still(chain)
        chain.thaw(name)

    return end


def _killed(name: str) -> Act:
    return lambda chain: chain.kill(name)


def _ended(name: str) -> Act:
    return lambda chain: chain.end(name)


def _made(name: str) -> Act:
    def make(chain: Chain) -> None:
        chain.make(name)
        if name == "steering":
            chain.page.holds_stick = False

    return make
