"""One lap: operator, interface and simulated robot in a loop on stepped time. The same seed gives the same lap."""

from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import Any, get_args

import numpy as np

from handsteer.config import Config, RobotConfig
from handsteer.errors import BenchError
from handsteer.plugins.bench.assisting import ASSISTS, Assistance
from handsteer.plugins.bench.courses import Course, off_stop, open_course
from handsteer.plugins.bench.hand_interfaces import Joystick, Point, Signs
from handsteer.plugins.bench.hand_view import HandView, LandmarkErrors, Through
from handsteer.plugins.bench.hands import Slips
from handsteer.plugins.bench.interfaces import TICK_S, Gamepad, Interface, Keys, Pad, Sliders, top_speed
from handsteer.plugins.bench.operator import DECISION_S, REACTION_S, Attention, Operator, Seen, Skill, adapted
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots import RobotState
from handsteer.robots.course import Referee
from handsteer.types import BUMP_S, MISS_S, CourseState, Pose2D, Velocity

TIMEOUT_S = 180.0
"""A lap that takes longer from the start gate on has failed, and counts with this time."""

_UNSTARTED_S = 60.0
_LATEST_S = 30.0
_STANDS_S, _STANDS_MPS, _STANDS_RADPS = 0.5, 0.02, 0.05
_ASIDE_M = 0.3
_TRACE_TICKS = 10
_DECISION_TICKS = round(DECISION_S / TICK_S)


_LIMITS = (
    ("latency_s", "latency in ms", 1e-3, 0, 5000),
    ("fps", "frames per second", 1.0, 5, 120),
    ("errors", "factor on errors", 1.0, 0, 20),
    ("reaction_s", "reaction time in ms", 1e-3, 0, 2000),
    ("gaps_s", "gaps of attention in ms", 1e-3, 0, 10_000),
)


@dataclass(frozen=True)
class Conditions:
    """What is varied in sweeps.

    Attributes:
        latency_s: Added delay in the loop, half of it on the way to the robot and half on the way back.
        fps: Frames per second of the camera of the hand.
        errors: Factor on errors of landmarks and on the operator's slips.
        reaction_s: The operator's reaction time.
        gaps_s: For so long, now and then, the operator does not look, and goes on as before.
        through: How the hand is seen.
        assist: Whether the control brakes or steers before obstacles.
    """

    latency_s: float = 0.0
    fps: float = 30.0
    errors: float = 1.0
    reaction_s: float = REACTION_S
    gaps_s: float = 0.0
    through: Through = "landmarks"
    assist: str = "off"

    def __post_init__(self) -> None:
        for name, what, unit, low, high in _LIMITS:
            value = getattr(self, name) / unit
            if not low <= value <= high:
                raise BenchError(f"{what}: {value:g} should be from {low:g} to {high:g}")
        if self.through not in get_args(Through):
            raise BenchError(f"through: {self.through!r} should be landmarks or pictures")
        if self.assist not in ASSISTS:
            raise BenchError(f"assist: {self.assist!r} should be {', '.join(ASSISTS)}")


def worse(conditions: Conditions) -> Conditions:
    """Return ``conditions`` with an operator who reacts in 0.4 s, errs twice as often, and looks away for 2 s."""
    return replace(conditions, reaction_s=0.4, errors=2 * conditions.errors, gaps_s=2.0)


@dataclass(frozen=True)
class Lap:
    """The result of one lap.

    Attributes:
        seed: Its seed.
        finished: Whether it ended before the timeout.
        time_s: From the start gate to the finish, or to rest at the place to stop at.
        gates: Number of gates passed.
        missed: Number of gates missed.
        bumps: How often the robot began to touch an obstacle while it moved; people also walk into one that stands.
        path_ratio: Length of the path driven, divided by that of the ideal path.
        cross_track_m: Root mean square of the distance from the ideal path.
        overshoot_m: How far beyond the place to stop at the robot came, >= 0; None if there is none.
        commands_per_min: Changes of the operator's act per minute.
        standing: Share of the time in which the robot stood, 0 to 1.
    """

    seed: int
    finished: bool
    time_s: float
    gates: int
    missed: int
    bumps: int
    path_ratio: float
    cross_track_m: float
    overshoot_m: float | None
    commands_per_min: float
    standing: float

    @property
    def score_s(self) -> float:
        """The course's score: the time, and penalties for bumps and missed gates, in seconds."""
        return self.time_s + BUMP_S * self.bumps + MISS_S * self.missed

    def as_dict(self) -> dict[str, Any]:
        """Return the fields and the score as plain values, for JSON."""
        return {**asdict(self), "score_s": self.score_s}


@dataclass(frozen=True)
class _Kind:
    """An interface: the skill of its operators, and the parameters it needs."""

    skill: Skill
    control: dict[str, Any] = field(default_factory=dict)
    make: Callable[..., Interface] = Signs
    by_hand: bool = True
    """Whether it needs a hand in front of a camera."""


_SIGNS = Skill(0.581, 1.121, 0.818, 1.942, 0.166)
"""For both ramps, which are the same at 30 frames a second."""

KINDS: dict[str, _Kind] = {
    "signs": _Kind(_SIGNS),
    "signs_per_second": _Kind(_SIGNS, {"ramp": "per_second"}),
    "joystick": _Kind(Skill(1.0, 1.374, 0.619, 1.907, 1.621), {"mode": "joystick"}, Joystick),
    "point": _Kind(Skill(1.0, 1.5, 0.5, 1.9, 1.5), {"rule": "point"}, Point),
    "pad": _Kind(Skill(0.944, 1.526, 0.491, 1.939, 1.658), make=Pad, by_hand=False),
    "keys": _Kind(Skill(0.846, 1.027, 0.289, 1.735, 1.189), make=Keys, by_hand=False),
    "sliders": _Kind(Skill(0.261, 0.752, 0.755, 1.409, 1.118), make=Sliders, by_hand=False),
    "gamepad": _Kind(Skill(0.944, 1.4, 0.61, 1.946, 1.779), make=Gamepad, by_hand=False),
}
"""The interfaces by name; the skills are from ``scripts/bench_skills.py``."""

INTERFACES = tuple(KINDS)


def run_lap(
    course: Course | str,
    interface: str,
    seed: int,
    conditions: Conditions | None = None,
    *,
    skill: Skill | None = None,
    config: Config | None = None,
    adapts: bool = True,
    trace: list[Pose2D] | None = None,
) -> Lap:
    """Drive one lap; the same arguments give the same lap, bit for bit.

    Args:
        course: The course, or its name.
        interface: One of :data:`INTERFACES`.
        seed: Of everything random, >= 0.
        conditions: Delays and errors; the defaults if None.
        skill: Of the operator, without added delay; that of the interface if None.
        config: Parameters that differ from the defaults; those that the interface needs override them.
        adapts: Whether the operator adapts the skill to added delay.
        trace: Receives the robot's pose ten times a second, from the start gate on.

    Raises:
        BenchError: There is no such interface, or the course is none.
        WorldError: There is no such world.
    """
    course = open_course(course) if isinstance(course, str) else course
    conditions = conditions or Conditions()
    if interface not in KINDS:
        raise BenchError(f"there is no interface {interface!r}; use {', '.join(INTERFACES)}")
    skill = skill or KINDS[interface].skill
    if adapts:
        skill = adapted(skill, conditions.latency_s + conditions.reaction_s - REACTION_S)
    config = config or Config()
    lap = _Run(course, conditions, seed, _opened(interface, conditions, skill, seed, config), skill, config=config)
    return lap.run(trace)


def _opened(name: str, conditions: Conditions, skill: Skill, seed: int, config: Config) -> Interface:
    kind = KINDS[name]
    control = config.control.model_copy(update={"arming": "off", "engage": "off", "renew": "off", **kind.control})
    random = np.random.default_rng([seed, 1])
    if not kind.by_hand:
        return kind.make(control, skill, random)
    if name == "point":
        control = control.model_copy(update={"max_linear": top_speed(skill)})
    camera = config.camera.model_copy(update={"fps": conditions.fps})
    config = config.model_copy(update={"control": control, "camera": camera})
    view = HandView(config, conditions.through, LandmarkErrors().scaled(conditions.errors), seed)
    slips = Slips()
    slips = replace(slips, wrong=slips.wrong * conditions.errors, unclear=slips.unclear * conditions.errors)
    return kind.make(config, skill, view, slips, random)


class _Run:
    """A lap in progress."""

    def __init__(
        self, course: Course, conditions: Conditions, seed: int, interface: Interface, skill: Skill, *, config: Config
    ) -> None:
        self._course, self._interface, self._seed = course, interface, seed
        self._robot = SimulatedRobot(RobotConfig(), course.world)
        self._assistance = Assistance(conditions.assist, config, self._robot)
        self._referee = Referee(course.gates)
        half_s = conditions.latency_s / 2
        random = np.random.default_rng([seed, 0])
        # So that each lap meets the people of the world elsewhere.
        walks = any(thing.route for thing in course.world.obstacles)
        self._later_s = float(random.uniform(0.0, _LATEST_S)) if walks else 0.0
        attention = Attention(conditions.gaps_s, np.random.default_rng([seed, 2]))
        self._operator = Operator(course, skill, conditions.reaction_s + half_s, random, attention)
        self._on_the_way: deque[tuple[int, Velocity]] = deque()
        self._delay_ticks = round((interface.delay_s + half_s) / TICK_S)
        self._tick = 0
        self._measures = _Measures(course)

    def run(self, trace: list[Pose2D] | None) -> Lap:
        state = self._robot.step(self._later_s)
        course = self._referee.step(state.truth, 0, state.time_s)
        while not self._measures.is_over(course, state):
            if self._tick % _DECISION_TICKS == 0:
                seen = Seen(state.truth, Velocity(state.linear_mps, state.angular_radps), bool(state.contacts))
                self._interface.want(self._operator.decide(seen))
            self._send(self._interface.step(), state.time_s)
            state = self._robot.step(TICK_S)
            self._assistance.note(state)
            self._tick += 1
            course = self._referee.step(state.truth, state.collisions or 0, state.time_s)
            self._measures.note(course, state, self._interface.changes)
            if trace is not None and course.phase != "ready" and self._tick % _TRACE_TICKS == 0:
                trace.append(state.truth)
        return self._measures.lap(self._seed, course)

    def _send(self, command: Velocity | None, now_s: float) -> None:
        if command is not None:
            self._on_the_way.append((self._tick + self._delay_ticks, command))
        while self._on_the_way and self._on_the_way[0][0] <= self._tick:
            _, wanted = self._on_the_way.popleft()
            command, goes_on = self._assistance.admit(wanted, now_s)
            if goes_on is not None:
                self._interface.hold_back(goes_on)
            self._robot.command(command.linear_mps, command.angular_radps)


class _Measures:
    """Measures a lap from its start gate on."""

    def __init__(self, course: Course) -> None:
        self._course = course
        self._ticks = 0
        self._waited = 0
        self._before: tuple[float, float] | None = None
        self._changes_before = self._changes = 0
        self._length_m = self._squares = 0.0
        self._stood = 0
        self._still = 0
        self._overshoot_m = 0.0
        self._s_m = 0.0
        self._touches = self._bumps = 0
        self._moved = False

    def note(self, course: CourseState, state: RobotState, changes: int) -> None:
        """Take the state after one tick."""
        pose = state.truth
        here = self._course.path.nearest(pose.x, pose.y, self._s_m)
        self._s_m = float(self._course.path.s[here])
        stands = abs(state.linear_mps) < _STANDS_MPS and abs(state.angular_radps) < _STANDS_RADPS
        self._still = self._still + 1 if stands else 0
        touches = (state.collisions or 0) - self._touches
        bumps = touches if self._moved else 0
        self._touches, self._moved = self._touches + touches, not stands
        if course.phase == "ready":
            self._waited += 1
            self._changes_before = changes
            return
        self._ticks += 1
        self._changes, self._bumps = changes, self._bumps + bumps
        self._stood += stands
        if self._before is not None:
            self._length_m += float(np.hypot(pose.x - self._before[0], pose.y - self._before[1]))
        self._before = pose.x, pose.y
        self._squares += float(np.sum((self._course.path.points[here] - (pose.x, pose.y)) ** 2))
        self._overshoot_m = max(self._overshoot_m, self._beyond(state))

    def is_over(self, course: CourseState, state: RobotState) -> bool:
        """Return whether the lap has ended."""
        if self._ticks * TICK_S >= TIMEOUT_S or self._waited * TICK_S >= _UNSTARTED_S:
            return True
        return self._is_finished(course, state)

    def _is_finished(self, course: CourseState, state: RobotState) -> bool:
        if course.phase != "finished":
            return False
        stop = self._course.world.stop
        if stop is None:
            return True
        along, across = off_stop(stop, state.truth)
        is_there = abs(along) <= stop.tolerance and abs(across) <= _ASIDE_M
        return is_there and self._still * TICK_S >= _STANDS_S

    def lap(self, seed: int, course: CourseState) -> Lap:
        """Return the result."""
        timed_out = self._ticks * TICK_S >= TIMEOUT_S or course.phase == "ready"
        time_s = TIMEOUT_S if timed_out else round(self._ticks * TICK_S, 2)
        ticks = max(1, self._ticks)
        return Lap(
            seed=seed,
            finished=not timed_out,
            time_s=time_s,
            gates=course.passed,
            missed=course.gates - course.passed,
            bumps=self._bumps,
            path_ratio=self._length_m / self._course.length_m,
            cross_track_m=float(np.sqrt(self._squares / ticks)),
            overshoot_m=self._overshoot_m if self._course.world.stop else None,
            commands_per_min=60 * (self._changes - self._changes_before) / (ticks * TICK_S),
            standing=self._stood / ticks,
        )

    def _beyond(self, state: RobotState) -> float:
        stop = self._course.world.stop
        return 0.0 if stop is None else off_stop(stop, state.truth)[0]
