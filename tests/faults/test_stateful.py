"""Random histories over the real recognition, control and relay in stepped time: never a motion without a live reason.

HANDSTEER_STEPS says how many steps: ``make check`` takes 4,000, ``make test`` 5,000, ``make test-all`` 20,000 and
``make soak`` a million.
"""

import gc
import itertools
import logging
import os
from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule

from handsteer.clock import SteppedClock
from handsteer.config import ControlConfig, RobotConfig, SignsConfig
from handsteer.images import image_message
from handsteer.messages import CMD_VEL, IMAGE_RAW, STEERING_CMD_VEL, STOP, Bool, Header, Image, Twist, twist
from handsteer.nodes.base import Node
from handsteer.nodes.control import HandSignControlNode
from handsteer.nodes.recognition import HandSignRecognitionNode
from handsteer.robots.command_limiter import CommandLimiter
from handsteer.timeouts import RESYNC_S
from handsteer.transports.base import Received
from handsteer.types import Velocity
from tests.faults.domain import Domain
from tests.faults.painted import FPS, PaintedCamera, painted_recognizer
from tests.faults.rules import Rules

STEPS_A_HISTORY = 50
HISTORIES_A_COLLECTION = 20
STEPS = int(os.environ.get("HANDSTEER_STEPS", "4000"))
MOTIONS = ("Forward", "Backward", "Turn Left", "Turn Right", "Go")
"""Go keeps what is: it is a reason to go on."""
NEUTRAL = ("Stop", "NONE")
_TICK_S = 1 / 30
_BEGIN_S = 100.0
RENEW_S = 3.0


class Graph:
    """Recognition, control and the relay to a real robot, and whoever shows, steers and stops."""

    def __init__(self) -> None:
        self.clock = SteppedClock(_BEGIN_S)
        self.domain = Domain()
        self.relay = CommandLimiter(RobotConfig())
        self.linked = True
        self.camera = PaintedCamera(self.clock)
        self.images = self.domain.advertise("camera", IMAGE_RAW)
        self.stick = self.domain.advertise("page", STEERING_CMD_VEL)
        self.stop = self.domain.advertise("page", STOP)
        self.domain.subscribe("relay", CMD_VEL, self._on_command)
        self.last_image: Image | None = None
        self._make: dict[str, Callable[[], Node]] = {"recognition": self._recognition, "control": self._control}
        self.nodes = {name: make() for name, make in self._make.items()}
        self.frozen: set[str] = set()

    @property
    def is_asked_to_move(self) -> bool:
        """Whether the real robot was told to move last."""
        return self.relay.velocity != Velocity()

    def show(self, sign: str, *, age_s: float = 0.0, again: bool = False) -> None:
        """Give the next picture; or the last one ``again``, as if it were new."""
        self.camera.sign = sign
        header = Header(self.clock.stamp(self.clock.now() - age_s), "camera")
        picture = self.last_image if again else image_message(self.camera.read().image, header)
        if picture is not None:
            image = Image(header, *(getattr(picture, name) for name in _PARTS))
            # What comes at a wrong time is not looked at: it is new when it comes again.
            self.last_image = self.last_image if age_s else image
            self.images.publish(image, self.clock.now() - age_s)
        self.serve()

    def serve(self) -> None:
        """Let all nodes do what is due."""
        alive = [node for name, node in self.nodes.items() if name not in self.frozen]
        while any([node.spin_once() for node in alive]):
            pass

    def tick(self, seconds: float) -> None:
        """Let a moment pass for all."""
        self.clock.advance(seconds)
        self.serve()
        self.relay.step(seconds, linked=self.linked)

    def restart(self, name: str) -> None:
        """Kill a node and start it again."""
        self.domain.kill(self.nodes[name].name)
        self.nodes[name] = self._make[name]()
        self.frozen.discard(name)

    def _on_command(self, received: Received[Twist]) -> None:
        speeds = received.message
        self.relay.command(Velocity(speeds.linear.x, speeds.angular.z))

    def _recognition(self) -> Node:
        config = SignsConfig()
        return HandSignRecognitionNode(self.domain, self.clock, painted_recognizer(config), config)

    def _control(self) -> Node:
        config = ControlConfig.model_validate({"linear_step": 0.2, "angular_step": 0.2, "renew_time": RENEW_S})
        return HandSignControlNode(self.domain, self.clock, config, arming=True, renew=True)


_PARTS = ("height", "width", "encoding", "is_bigendian", "step", "data")


class Histories(RuleBasedStateMachine):
    """Each step is something that people, machines or networks do."""

    ended = itertools.count(1)

    def __init__(self) -> None:
        super().__init__()
        logging.disable(logging.CRITICAL)
        self.graph = Graph()
        self.oracle = Rules(renew_s=RENEW_S)
        self.wrong_since: tuple[float, float] | None = None

    def teardown(self) -> None:
        logging.disable(logging.NOTSET)
        # The nodes are cycles that hold megabytes of pictures: by its own count of objects, the search for garbage
        # comes ever more seldom, and a million steps took more memory than a machine has.
        if next(self.ended) % HISTORIES_A_COLLECTION == 0:
            gc.collect()

    @initialize(sign=st.sampled_from(MOTIONS))
    def begin(self, sign: str) -> None:
        self.wait(1.2)
        self.drive(sign)
        # Or else whatever comes would prove nothing; Go alone sets nothing in motion.
        assert self.graph.is_asked_to_move == (sign != "Go")

    def wait(self, seconds: float) -> None:
        """Let time pass in moments, and look at each."""
        while seconds > 1e-9:
            moment = min(seconds, _TICK_S)
            self.graph.tick(moment)
            self.look()
            seconds -= moment

    def look(self) -> None:
        self.oracle.now_s = self.graph.clock.now()
        if self.graph.is_asked_to_move:
            why_not = self.oracle.why_not()
            assert why_not is None, f"at {self.oracle.now_s:.2f} s the robot is asked to move, though {why_not}"
        else:
            self.oracle.stands()

    @rule(sign=st.sampled_from(MOTIONS + NEUTRAL), frames=st.integers(1, 8))
    def show(self, sign: str, frames: int) -> None:
        for _ in range(frames):
            self.picture(sign)
            self.wrong_since = None
            self.graph.show(sign)
            self.look()
            self.wait(1 / FPS)

    def picture(self, sign: str) -> None:
        self.oracle.now_s = self.graph.clock.now()
        self.oracle.picture(sign, asks=sign in MOTIONS)

    @rule(sign=st.sampled_from(MOTIONS))
    def drive(self, sign: str) -> None:
        self.show("Stop", 2)
        self.show(sign, 10)

    @rule(sign=st.sampled_from(MOTIONS), frames=st.integers(10, 16))
    def hold(self, sign: str, frames: int) -> None:
        self.show(sign, frames)

    @rule(sign=st.sampled_from(MOTIONS), by_stick=st.booleans())
    def never_change(self, sign: str, by_stick: bool) -> None:
        """Longer than may be; one who does not let go then drives no more."""
        if by_stick:
            self.steer(0.0, 1)
            self.steer(0.5, 45)
        else:
            self.drive(sign)
            self.show(sign, 120)
        assert not self.graph.is_asked_to_move

    @precondition(lambda self: self.oracle.is_stopped or not self.graph.linked)
    @rule()
    def begin_anew(self) -> None:
        self.reset()
        if not self.graph.linked:
            self.the_robot_comes_back()
        self.wait(0.4)
        self.drive("Forward")

    @rule(frames=st.integers(1, 20))
    def freeze_the_picture(self, frames: int) -> None:
        self.wrong_since = None
        for _ in range(frames):
            self.graph.show(self.graph.camera.sign, again=True)
            self.look()
            self.wait(1 / FPS)

    @rule(sign=st.sampled_from(MOTIONS + NEUTRAL), frames=st.integers(1, 8), age_s=st.sampled_from([-5.0, 0.6, 5.0]))
    def show_with_wrong_times(self, sign: str, frames: int, age_s: float) -> None:
        """Such pictures count only if they go on: then the camera's clock was set."""
        for _ in range(frames):
            now_s = self.graph.clock.now()
            if self.wrong_since is None or self.wrong_since[0] != age_s:
                self.wrong_since = age_s, now_s
            elif now_s - self.wrong_since[1] >= RESYNC_S - _TICK_S:
                self.picture(sign)
            self.graph.show(sign, age_s=age_s)
            self.look()
            self.wait(1 / FPS)

    @rule(speed=st.sampled_from([0.5, -0.5, 0.0, float("nan")]), count=st.integers(1, 5))
    def steer(self, speed: float, count: int) -> None:
        for _ in range(count):
            self.oracle.now_s = self.graph.clock.now()
            self.oracle.stick(asks=speed in (0.5, -0.5), speed=speed)
            self.graph.stick.publish(twist(speed, 0.0))
            self.graph.serve()
            self.look()
            self.wait(0.1)

    @rule()
    def stop(self) -> None:
        self.oracle.stop()
        self.graph.stop.publish(Bool(data=True))
        self.wait(_TICK_S)

    @rule()
    def reset(self) -> None:
        self.oracle.reset()
        self.graph.stop.publish(Bool(data=False))
        self.wait(_TICK_S)

    @rule(seconds=st.sampled_from([0.05, 0.2, 0.34, 0.36, 0.45, 0.7, 1.2]))
    def nothing_comes(self, seconds: float) -> None:
        self.wait(seconds)

    @rule(seconds=st.sampled_from([0.1, 0.3, 0.7, 5.0, 100.0]))
    def the_clock_jumps(self, seconds: float) -> None:
        self.graph.clock.advance(seconds)
        if seconds > 0.5:
            self.oracle.disarm()
        self.graph.relay.step(seconds, linked=self.graph.linked)
        self.wait(_TICK_S)

    @rule(name=st.sampled_from(["control", "recognition"]))
    def restart(self, name: str) -> None:
        if name == "control":
            self.oracle.disarm()
        else:
            self.oracle.recognition_begins()
        self.graph.restart(name)
        self.wait(_TICK_S)

    @rule(name=st.sampled_from(["control", "recognition"]), seconds=st.sampled_from([0.2, 0.7, 1.5]))
    def freeze(self, name: str, seconds: float) -> None:
        self.graph.frozen.add(name)
        if seconds > 0.6:
            self.oracle.disarm(stick=name == "control")  # steering does not depend on the camera
        self.wait(seconds)
        self.graph.frozen.discard(name)
        self.wait(_TICK_S)

    @precondition(lambda self: self.graph.linked)
    @rule()
    def the_robot_leaves(self) -> None:
        self.graph.linked = False
        self.oracle.robot_was_away()
        self.wait(_TICK_S)

    @precondition(lambda self: not self.graph.linked)
    @rule()
    def the_robot_comes_back(self) -> None:
        self.graph.linked = True
        self.oracle.robot_was_away()
        self.wait(_TICK_S)


def test_a_robot_that_comes_back_while_a_new_sign_is_not_confirmed_yet_may_follow_it() -> None:
    """Found in 155,000 steps: zero is commanded after it has come back, and so it may move."""
    history = Histories()
    history.begin("Forward")
    history.hold("Forward", 10)
    history.the_robot_leaves()
    history.show("Backward", 1)
    history.the_robot_comes_back()
    history.hold("Backward", 10)
    assert history.graph.relay.velocity.linear_mps < 0
    history.teardown()


@pytest.mark.parametrize("frames", [8, 16])
def test_a_robot_that_comes_back_does_not_follow_what_was_shown_all_the_time(frames: int) -> None:
    history = Histories()
    history.begin("Forward")
    history.the_robot_leaves()
    history.show("Backward", frames)
    history.the_robot_comes_back()
    history.hold("Backward", 16)
    assert not history.graph.is_asked_to_move
    history.teardown()


def test_a_robot_that_comes_back_while_recognition_begins_may_follow_a_sign() -> None:
    """Found in 200,000 steps: zero is commanded until the sign is confirmed anew."""
    history = Histories()
    history.begin("Forward")
    history.the_robot_leaves()
    history.show("Forward", 8)
    history.the_robot_comes_back()
    history.restart("recognition")
    history.hold("Forward", 16)
    assert history.graph.is_asked_to_move
    history.teardown()


def test_a_robot_that_comes_back_follows_a_released_stick_that_is_deflected_then() -> None:
    """Found in 200,000 steps: it was asked anew, though nobody had sent a zero since it came back."""
    history = Histories()
    history.begin("Forward")
    history.steer(0.0, 2)
    history.the_robot_leaves()
    history.show("Forward", 120)
    history.the_robot_comes_back()
    history.nothing_comes(0.36)
    history.steer(-0.5, 2)
    assert history.graph.relay.velocity.linear_mps < 0
    history.teardown()


def test_a_robot_that_comes_back_does_not_follow_a_stick_that_was_held() -> None:
    history = Histories()
    history.begin("Forward")
    history.steer(0.0, 2)
    history.steer(0.5, 3)
    history.the_robot_leaves()
    history.steer(0.5, 5)
    history.the_robot_comes_back()
    history.steer(0.5, 3)
    assert not history.graph.is_asked_to_move
    history.teardown()


def test_pictures_of_a_camera_whose_clock_was_set_count_after_a_moment() -> None:
    """Found in 200,000 steps: they go on with the same wrong time, and neutral was seen in them."""
    history = Histories()
    history.begin("Forward")
    history.show_with_wrong_times("Forward", 3, -5.0)
    history.nothing_comes(0.7)
    history.show_with_wrong_times("Stop", 8, -5.0)
    history.show_with_wrong_times("Forward", 8, -5.0)
    assert history.graph.is_asked_to_move
    history.teardown()


def test_pictures_with_wrong_times_do_not_make_a_frozen_one_new() -> None:
    """Found in 185,000 steps: they were remembered in place of what the camera had given before."""
    history = Histories()
    history.begin("Forward")
    history.show_with_wrong_times("Forward", 8, -5.0)
    history.freeze_the_picture(7)
    assert not history.graph.is_asked_to_move
    history.teardown()


Histories.TestCase.settings = settings(
    max_examples=max(1, STEPS // STEPS_A_HISTORY),
    stateful_step_count=STEPS_A_HISTORY,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
TestHistories = Histories.TestCase
