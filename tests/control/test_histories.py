"""Random histories of signs, joysticks, steering, stops and faults: never a command without a live reason.

HANDSTEER_STEPS says how many steps: ``make check`` takes 4,000, ``make test`` 5,000, ``make test-all`` 20,000 and
``make soak`` a million.
"""

import math
import os
from dataclasses import dataclass, field

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

from handsteer.config import ControlConfig
from handsteer.control import Control
from handsteer.types import ZERO, Stick, Velocity

STEPS_A_HISTORY = 20
STEPS = int(os.environ.get("HANDSTEER_STEPS", "4000"))
SIGNS = ("Forward", "Backward", "Turn Left", "Turn Right", "Go", "Stop", "NONE", "a word nobody knows")
PERIOD_S = 1 / 30
ACCELERATION, JERK = 0.8, 4.0
_SLACK = 1e-6
RENEW_S = 4.0


@dataclass
class Onlooker:
    """Knows what was shown, said and done, and when; no filter and no velocity."""

    mode: str
    arming: bool
    engage: bool
    now_s: float = 0.0
    is_stopped: bool = False
    hand_s: float = -math.inf
    hand_asks: bool = False
    sign_s: float = -math.inf
    steered_s: float = -math.inf
    steering_asks: bool = False
    steering_was_released: bool = False
    was_released: bool = False
    neutral_s: float = 0.0
    palm_s: float = 0.0
    palm_seen_s: float = -math.inf
    is_engaged: bool = False
    engage_by: str = "hold"
    was_made: bool = True
    renew: bool = False
    shown: dict[str, object] = field(default_factory=dict)
    changed_s: dict[str, float] = field(default_factory=dict)
    was_too_long: set[str] = field(default_factory=set)

    def shows(self, source: str, what: object) -> None:
        """What drives shows this; it shows nothing new while that stays the same."""
        if what != self.shown.get(source) or what == 0.0:
            self.shown[source], self.changed_s[source] = what, self.now_s

    def is_unchanged(self, source: str) -> bool:
        return self.renew and self.now_s - self.changed_s.get(source, self.now_s) >= RENEW_S - _SLACK

    def too_long(self, source: str) -> None:
        """It has driven for too long without any change: it must show neutral."""
        self.was_too_long.add(source)
        if source == "signs":
            self.neutral_s = 0.0

    def interrupt(self, *, disarms: bool = True) -> None:
        """Something happened after which the hand must show neutral, and engage."""
        self.was_released = self.is_engaged = False
        self.palm_s, self.palm_seen_s = 0.0, -math.inf
        self.was_made = True
        if disarms:
            self.neutral_s = 0.0

    def hold_up(self, *, disarms: bool) -> None:
        """Something happened after which what steers has to be released too."""
        self.interrupt(disarms=disarms)
        self.steering_was_released = False

    def steer(self, speed: float, timeout_s: float) -> None:
        """A pad says how far it is pushed."""
        is_lost = self.steering_asks and self.now_s - self.steered_s >= timeout_s - _SLACK
        self.steered_s, self.steering_asks = self.now_s, speed != 0.0
        self.was_released = False
        self.shows("steering", speed)
        if speed == 0.0:
            self.steering_was_released = True
            self.was_too_long.discard("steering")
        elif is_lost or not math.isfinite(speed):
            self.steering_was_released = False

    def wait(self, seconds: float, timeout_s: float) -> None:
        """Time passes."""
        self.now_s += seconds
        if self.now_s - self.hand_s >= timeout_s - _SLACK:
            self.interrupt(disarms=self.arming)
        if self.now_s - self.sign_s >= 5.0 - _SLACK:
            self.is_engaged, self.was_made = False, True

    def hand(self, *, asks: bool, released: bool, stops: bool) -> None:
        """The input that drives comes from the hand."""
        gap_s, self.hand_s = self.now_s - self.hand_s, self.now_s
        self.hand_asks = asks
        self.was_released = self.was_released or released
        if released:
            self.was_too_long.discard("joystick")
        if stops:
            self.neutral_s = math.inf
        elif not asks:
            self.neutral_s += min(gap_s, 0.1)
        elif self.neutral_s < 0.5 - _SLACK:
            self.neutral_s = 0.0
        if self.neutral_s >= 0.5 - _SLACK:
            self.was_too_long.discard("signs")

    def sign(self, sign: str) -> None:
        """A sign comes, which may engage whatever drives."""
        if sign != "NONE":
            self.sign_s = self.now_s
        gap_s = self.now_s - self.palm_seen_s
        if self.engage_by == "gesture" and sign == "Stop":
            self.palm_seen_s = self.now_s
        elif sign == "Stop":
            self.palm_s = self.palm_s + gap_s if gap_s < 0.3 else 0.0
            self.palm_seen_s = self.now_s
            self.is_engaged = self.is_engaged or self.palm_s >= 1.0 - _SLACK
        else:
            self.palm_s, self.palm_seen_s = 0.0, -math.inf

    def gesture(self, *, is_made: bool) -> None:
        """A frame shows whether the gesture has just been made."""
        if is_made and not self.was_made and self.engage_by == "gesture" and not self.is_stopped:
            self.is_engaged = self.is_engaged or self.now_s - self.palm_seen_s < 0.3
        self.was_made = is_made

    def why_not(self, source: str, config: ControlConfig) -> str | None:
        """Return why ``source`` must not move the robot now; None if it may."""
        if source == "steering":
            live = self.now_s - self.steered_s < config.steering_timeout + _SLACK
            reasons = {
                "nobody steers": not live or not self.steering_asks,
                "what steers was not released before": not self.steering_was_released,
            }
        else:
            reasons = {
                "no frame has come for a while": self.now_s - self.hand_s >= config.sign_timeout + _SLACK,
                "the hand asks for nothing": not self.hand_asks,
                "it is not engaged": self.engage and not self.is_engaged,
                "the joystick was not released before": self.mode == "joystick" and not self.was_released,
                "neutral was not seen": self.arming and self.neutral_s < 0.5 - _SLACK,
            }
        reasons["it is stopped"] = self.is_stopped
        reasons["nothing has changed for too long"] = self.is_unchanged(source)
        reasons["it was not released since nothing had changed for too long"] = source in self.was_too_long
        return next((reason for reason, holds in reasons.items() if holds), None)


class Histories(RuleBasedStateMachine):
    """Each rule is something that people, machines or networks do."""

    @initialize(
        mode=st.sampled_from(["signs", "joystick"]),
        by=st.sampled_from(["course", "point"]),
        ramp=st.sampled_from(["per_message", "per_second"]),
        guards=st.tuples(st.booleans(), st.booleans(), st.booleans()),
        engage_by=st.sampled_from(["gesture", "hold"]),
    )
    def begin(self, mode: str, by: str, ramp: str, guards: tuple[bool, bool, bool], engage_by: str) -> None:
        arming, engage, renew = guards
        limits = {
            "engage_by": engage_by,
            "renew_time": RENEW_S,
            "max_linear_acceleration": ACCELERATION,
            "max_angular_jerk": JERK,
            "linear_step": 0.2,
        }
        self.config = ControlConfig.model_validate({"mode": mode, "rule": by, "ramp": ramp, **limits})
        self.control = Control(self.config, arming=arming, engage=engage, renew=renew)
        self.onlooker = Onlooker(self.what_drives, arming, engage, engage_by=engage_by, renew=renew)
        self.commanded, self.commanded_s, self.source = ZERO, 0.0, "none"
        self.get_ready()

    @property
    def what_drives(self) -> str:
        return "joystick" if self.config.by_stick else "signs"

    def look(self, velocity: Velocity | None) -> None:
        """Compare what is commanded with what the onlooker knows."""
        if not self.commanded.is_zero and self.onlooker.is_unchanged(self.source):
            self.onlooker.too_long(self.source)
        if velocity is not None:
            since_s = min(self.onlooker.now_s - self.commanded_s, self.config.sign_timeout)
            before = self.commanded.linear_mps if self.commanded.linear_mps * velocity.linear_mps > 0 else 0.0
            assert abs(velocity.linear_mps) - abs(before) <= ACCELERATION * since_s + _SLACK
            self.commanded, self.commanded_s = velocity, self.onlooker.now_s
        assert self.commanded.is_finite
        assert abs(self.commanded.linear_mps) <= self.config.max_linear
        assert abs(self.commanded.angular_radps) <= self.config.max_angular
        if not self.commanded.is_zero:
            why_not = self.onlooker.why_not(self.control.mux.source, self.config)
            self.source = self.control.mux.source
            assert why_not is None, f"at {self.onlooker.now_s:.2f} s it commands {self.commanded}, though {why_not}"

    def pass_time(self, seconds: float) -> None:
        """Let the watchdog of the node run."""
        while seconds > 1e-9:
            moment = min(seconds, 0.02)
            self.onlooker.wait(moment, self.config.sign_timeout)
            self.look(self.control.step(moment))
            seconds -= moment

    def frame(self, sign: str, stick: Stick, period_s: float = PERIOD_S) -> None:
        """Receive what recognition publishes of one frame."""
        self.pass_time(period_s)
        self.onlooker.sign(sign)
        self.onlooker.shows("signs", sign)
        deflection = (stick.forward, stick.left)
        # Where the hand points drives, a sign that stops does so whatever the stick says.
        is_held = stick.held and not (self.config.points and sign in {"Stop", "NONE"})
        self.onlooker.shows("joystick", deflection if is_held and any(deflection) else 0.0)
        if self.config.by_stick:
            self.onlooker.hand(asks=is_held, released=not is_held, stops=False)
        else:
            self.onlooker.hand(asks=sign not in {"Stop", "NONE"}, released=False, stops=sign == "Stop")
        self.look(self.control.step(0.0, sign=sign, stick=stick))

        self.note_gesture(is_made=False)

    def note_gesture(self, *, is_made: bool) -> None:
        self.onlooker.gesture(is_made=is_made)
        self.control.note_gesture(is_done=is_made)

    @rule()
    def get_ready(self) -> None:
        for _ in range(65):
            self.frame("Stop", Stick())
        self.note_gesture(is_made=True)

    @rule(sign=st.sampled_from(["Stop", "Forward", "NONE"]), wait_s=st.sampled_from([0.0, 0.1, 0.33]))
    def claim_the_gesture(self, sign: str, wait_s: float) -> None:
        self.frame(sign, Stick())
        self.pass_time(wait_s)
        self.note_gesture(is_made=True)
        self.drive_on("Forward")

    @rule(
        sign=st.sampled_from(SIGNS),
        held=st.booleans(),
        deflection=st.tuples(st.sampled_from([-1.0, 0.0, 0.4, math.nan]), st.sampled_from([-1.0, 0.0, 0.7, math.inf])),
        frames=st.sampled_from([1, 2, 4, 12, 40]),
        period_s=st.sampled_from([PERIOD_S, PERIOD_S, 0.1, 0.32]),
    )
    def show(self, sign: str, held: bool, deflection: tuple[float, float], frames: int, period_s: float) -> None:
        for _ in range(frames):
            self.frame(sign, Stick(held, *deflection), period_s)

    @rule(sign=st.sampled_from(["Forward", "Go"]))
    def drive_on(self, sign: str) -> None:
        for _ in range(20):
            self.frame(sign, Stick(held=True, forward=0.4))

    @rule(sign=st.sampled_from(["Forward", "Turn Left", "Go"]), changes=st.booleans())
    def drive_on_for_long(self, sign: str, changes: bool) -> None:
        self.get_ready()
        for count in range(150):
            self.frame("Go" if changes and count % 40 > 35 else sign, Stick(held=True, forward=0.4))
        self.frame("NONE", Stick(held=True, forward=-0.4))
        self.drive_on("Backward")

    @rule()
    def steer_for_a_moment_while_the_fist_is_closed(self) -> None:
        self.steer(0.0, 1, 0.1)
        self.steer(0.5, 2, 0.1)
        self.drive_on("Go")
        self.drive_on("Go")

    @rule()
    def lose_the_camera_while_driving(self) -> None:
        self.drive_on("Go")
        self.pass_time(0.6)

    @rule()
    def look_away_for_long(self) -> None:
        for _ in range(52):
            self.frame("NONE", Stick(), 0.1)
        self.drive_on("Forward")

    @rule(period_s=st.sampled_from([0.2, 0.32]))
    def show_the_palm_now_and_then(self, period_s: float) -> None:
        self.the_robot_is_away()
        for _ in range(5):
            self.frame("Stop", Stick(), period_s)
        self.drive_on("Forward")

    @rule(seconds=st.sampled_from([0.05, 0.2, 0.34, 0.36, 0.6, 1.2, 5.5]))
    def nothing_comes(self, seconds: float) -> None:
        self.pass_time(seconds)

    @rule(
        speed=st.sampled_from([0.5, -0.5, 0.0, math.nan]), count=st.integers(1, 4), period_s=st.sampled_from([0.1, 0.4])
    )
    def steer(self, speed: float, count: int, period_s: float) -> None:
        for _ in range(count):
            self.onlooker.steer(speed, self.config.steering_timeout)
            self.look(self.control.step(0.0, steering=Velocity(speed, 0.0)))
            self.pass_time(period_s)

    @rule()
    def stop(self) -> None:
        self.onlooker.is_stopped = True
        self.onlooker.interrupt(disarms=False)
        self.look(self.control.stop())

    @rule()
    def reset(self) -> None:
        if self.onlooker.is_stopped:
            self.onlooker.hold_up(disarms=True)
        self.onlooker.is_stopped = False
        self.control.reset()

    @rule()
    def the_robot_is_away(self) -> None:
        self.onlooker.hold_up(disarms=self.onlooker.arming)
        self.control.safety.robot_is_away("nobody listens")
        self.look(self.control.halt())

    @rule(mode=st.sampled_from(["signs", "joystick"]), by=st.sampled_from(["course", "point"]))
    def change_the_rule(self, mode: str, by: str) -> None:
        config = self.config.model_copy(update={"mode": mode, "rule": by})
        if (mode, by) != (self.config.mode, self.config.rule):
            self.onlooker.hold_up(disarms=True)
        self.config = config
        self.onlooker.mode = self.what_drives
        self.look(self.control.reconfigure(config))

    @rule(dt_s=st.sampled_from([-1.0, math.nan, math.inf]))
    def the_clock_is_wrong(self, dt_s: float) -> None:
        self.onlooker.hold_up(disarms=self.onlooker.arming)
        self.look(self.control.step(dt_s, sign="Forward", stick=Stick(held=True, forward=1.0)))


Histories.TestCase.settings = settings(
    max_examples=max(1, STEPS // STEPS_A_HISTORY),
    stateful_step_count=STEPS_A_HISTORY,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
TestHistories = Histories.TestCase
