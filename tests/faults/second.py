"""Rows of what should be there once and is there twice: a second control, another camera, a bag in a live graph."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from handsteer.config import SignsConfig
from handsteer.messages import (
    CAMERA_CHANGED,
    CMD_VEL,
    HAND_SIGN,
    IMAGE_RAW,
    STEERING_CMD_VEL,
    STOP,
    String,
    Topic,
    twist,
)
from handsteer.nodes.base import Node
from handsteer.nodes.control import HandSignControlNode
from handsteer.nodes.recognition import HandSignRecognitionNode
from handsteer.transports.base import Publisher, Received, Subscription
from tests.faults.chain import SECOND_CONTROL, SPEED_MPS, Chain
from tests.faults.painted import painted_recognizer
from tests.faults.row import Row, lower_the_hand, nothing, publish_for_ever, silence

BAG_S = 0.5


def seconds() -> Iterator[Row]:
    """Return all of them."""
    yield from _controls()
    yield Row("camera", "another camera is chosen, which sees the same hand", _choose_another, make=ChoiceChain)
    yield from _bags()


class _Beside:
    """The chain's transport for a node whose name is taken, so that it can end alone."""

    def __init__(self, chain: Chain) -> None:
        self._inner = chain.faults
        self.crosses_network, self.is_one_machine = self._inner.crosses_network, self._inner.is_one_machine

    def advertise(self, node: str, topic: Topic[Any]) -> Publisher[Any]:
        return self._inner.advertise(f"second_{node}", topic)

    def subscribe(self, node: str, topic: Topic[Any], deliver: Callable[[Received[Any]], None]) -> Subscription:
        return self._inner.subscribe(f"second_{node}", topic, deliver)

    def publishers_of(self, topic: Topic[Any]) -> list[str]:
        return self._inner.publishers_of(topic)

    def topic_name(self, topic: Topic[Any]) -> str:
        return topic.name

    def full_name(self, node: str) -> str:
        return f"second_{node}"

    def close(self) -> None:
        pass


def _start_second(chain: Chain) -> None:
    chain.nodes["second"] = HandSignControlNode(_Beside(chain), chain.clock, chain.limits(), arming=True)


def _end_second(chain: Chain) -> None:
    chain.domain.kill(SECOND_CONTROL)
    del chain.nodes["second"]


def _controls() -> Iterator[Row]:
    yield Row("control", "a second one runs; then the driver stops", _start_second, _end_second, lower_the_hand)

    def freeze(chain: Chain) -> None:
        chain.freeze("control")
        _start_second(chain)

    def thaw(chain: Chain) -> None:
        _end_second(chain)
        chain.thaw("control")

    def replace(chain: Chain) -> None:
        chain.kill("control")
        _start_second(chain)

    def put_back(chain: Chain) -> None:
        _end_second(chain)
        chain.make("control")

    for by_stick in (False, True):
        held = ", the stick is held" if by_stick else ""
        yield Row("control", f"frozen, and a second one is started{held}", freeze, thaw, by_stick=by_stick)
        yield Row("control", f"killed, and a second one is started{held}", replace, put_back, by_stick=by_stick)

    def stop_and_start(chain: Chain) -> None:
        chain.say_stop(stop=True)
        chain.run(0.1)
        _start_second(chain)

    fault = "Stop, published once; then a second control is started"
    yield Row(STOP.name, fault, stop_and_start, is_for_good=True)


class ChoiceChain(Chain):
    """The chain with a choice of cameras, as ``handsteer run`` has."""

    def _control(self) -> Node:
        return HandSignControlNode(self.faults, self.clock, self.limits(), arming=True, camera_changed=CAMERA_CHANGED)

    def _recognition(self) -> Node:
        config = SignsConfig()
        return HandSignRecognitionNode(
            self.faults, self.clock, painted_recognizer(config), config, camera_changed=CAMERA_CHANGED
        )


def _choose_another(chain: Chain) -> None:
    chain.faults.advertise("my_camera", CAMERA_CHANGED).publish(String(data="another"), chain.clock.now())


class _Player(Node):
    """Plays what was recorded, again and again, with the stamps of then, as ``ros2 bag play --loop`` does."""

    def __init__(self, chain: Chain, bag: list[tuple[float, Topic[Any], Any]]) -> None:
        super().__init__("another", chain.faults, chain.clock)
        self._bag = bag
        self._publishers = {topic.name: self.publisher(topic) for _, topic, _ in bag}
        self._began_s, self._next = chain.clock.now(), 0
        self.every(0.005, self._play)

    def _play(self) -> None:
        while self._next < len(self._bag):
            at_s, topic, message = self._bag[self._next]
            if at_s - self._bag[0][0] > self.clock.now() - self._began_s:
                return
            self._publishers[topic.name].publish(message)
            self._next += 1
        self._began_s, self._next = self.clock.now(), 0


class BagChain(Chain):
    """The chain with a recorder that keeps the last half second."""

    def __init__(self) -> None:
        super().__init__()
        self._bag: list[tuple[float, Topic[Any], Any]] = []
        topics: tuple[Topic[Any], ...] = (IMAGE_RAW, HAND_SIGN, STEERING_CMD_VEL, CMD_VEL)
        for topic in topics:
            self.faults.subscribe("bag", topic, partial(self._keep, topic))

    def play(self, *topics: Topic[Any]) -> None:
        """Play these topics from now on."""
        self.domain.kill("bag")
        began_s = self.clock.now() - BAG_S
        bag = [each for each in self._bag if each[0] >= began_s and each[1] in topics]
        assert bag, topics
        self.nodes["another"] = _Player(self, bag)

    def _keep(self, topic: Topic[Any], received: Received[Any]) -> None:
        self._bag.append((self.clock.now(), topic, received.message))


def _bags() -> Iterator[Row]:
    for words, topics, drives in (
        ("its pictures", (IMAGE_RAW,), False),
        ("its signs", (HAND_SIGN,), True),
        ("its commands", (CMD_VEL,), True),
        ("all topics", (IMAGE_RAW, HAND_SIGN, CMD_VEL), True),
    ):

        def play(chain: Chain, topics: tuple[Topic[Any], ...] = topics) -> None:
            assert isinstance(chain, BagChain)
            lower_the_hand(chain)
            chain.play(*topics)

        after = "; then it ends" if drives else ""
        fault = f"a bag of the drive is played: {words}; the hand is lowered{after}"
        yield Row("all nodes", fault, play, silence, silence if drives else nothing, make=BagChain)

    def hold(chain: Chain) -> None:
        lower_the_hand(chain)
        publish_for_ever(chain, STEERING_CMD_VEL, lambda: twist(SPEED_MPS, 0.0), 0.1)

    fault = "a bag is played that begins while a stick is held; the hand is lowered"
    yield Row("all nodes", fault, hold, silence)

    def play_and_stop(chain: Chain) -> None:
        assert isinstance(chain, BagChain)
        chain.play(IMAGE_RAW, HAND_SIGN, STEERING_CMD_VEL)
        chain.run(0.2)
        chain.steering.halt()

    def over(chain: Chain) -> None:
        silence(chain)
        chain.steering.reset()

    fault = "a bag of the drive is played: all but its commands; Stop from the page"
    yield Row("all nodes", fault, play_and_stop, over, by_stick=True, make=BagChain)
