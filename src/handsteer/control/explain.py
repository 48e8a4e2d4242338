"""Explains in words why the robot drives or stands."""

import math
from dataclasses import dataclass
from typing import Literal

from handsteer.timeouts import RENEW_WARNING_S

ReasonCode = Literal[
    "sign",
    "steered",
    "joystick",
    "pointed",
    "stopped",
    "inactive",
    "starting",
    "disarmed",
    "disengaged",
    "steering_disarmed",
    "renew",
    "renew_stick",
    "no_image",
    "no_scan",
    "obstacle",
    "steered_at_zero",
    "not_held",
    "held",
    "no_input",
    "no_sign",
    "stop_sign",
    "not_started",
]
"""Every reason for what is commanded; the first four are those of a robot that drives."""

_SENTENCES: dict[ReasonCode, str] = {
    "sign": "{}",
    "steered": "steered directly",
    "joystick": "driven by the hand as a joystick",
    "pointed": "driven where the hand points",
    "stopped": "stopped, until it is reset",
    "inactive": "deactivated: another program activates this node",
    "starting": "has just started: whether the robot was stopped before is not known yet",
    "disarmed": "show Stop or lower your hand to begin{}",
    "disengaged": "open, close and open your hand to begin",
    "steering_disarmed": "the steering is held: release it first",
    "renew": "the same sign for {} s: show Stop or lower your hand, then show it again",
    "renew_stick": "the stick has not moved for {} s: release it first",
    "no_image": "{}",
    "no_scan": "{}",
    "obstacle": "stopped before an {}",
    "steered_at_zero": "steered directly, at zero",
    "not_held": "no hand holds the joystick: open it, then close the fist",
    "held": "the joystick is held, in the middle",
    "no_input": "no sign has come for {} s",
    "no_sign": "no sign is seen",
    "stop_sign": "the {} sign is shown",
    "not_started": "no sign has set it in motion yet",
}

State = Literal["driving", "standing", "stopping", "ready", "disengaged"]
"""What the robot does, in a word: ``stopping`` until it stands, ``ready`` when it waits for neutral."""


@dataclass(frozen=True)
class Reason:
    """Why the robot is commanded to drive, or to stand.

    Attributes:
        code: For programs.
        detail: What the code leaves open: the sign, why it is disarmed, which obstacle, ...
        robot: The robot that is disarmed, if there are several; else empty.
        slowed: The obstacle that slows it, as ``obstacle 0.42 m ahead``; empty if none does.
        steered: Where an assist steers it, as ``left of an obstacle 0.42 m ahead``; empty if none does.
    """

    code: ReasonCode
    detail: str = ""
    robot: str = ""
    slowed: str = ""
    steered: str = ""

    @property
    def is_driving(self) -> bool:
        """Whether the robot is to move."""
        return self.code in ("sign", "steered", "joystick", "pointed")

    def state(self, *, is_moving: bool = False) -> State:
        """Return what the robot does, if it is measured to move as ``is_moving`` says."""
        if self.is_driving:
            return "driving"
        if is_moving:
            return "stopping"
        return (
            "ready" if self.code in ("disarmed", "renew") else "disengaged" if self.code == "disengaged" else "standing"
        )

    @property
    def explanation(self) -> str:
        """The reason in words, without what the robot does, as ``no sign is seen``."""
        robot = f" with {self.robot}" if self.robot else ""
        detail = self.detail
        if self.code == "disengaged" and detail:
            return f"hold an open palm for {detail} s to begin{robot}"
        if self.code == "not_started" and detail:
            return f"{detail} keeps its speed, which is zero{robot}"
        if self.code == "disarmed":
            detail = f"{robot} ({detail})" if detail else robot
            robot = ""
        slowed = f", slowed: {self.slowed}" if self.slowed else ""
        slowed += f", steering {self.steered}" if self.steered else ""
        return f"{_SENTENCES[self.code].format(detail)}{robot}{slowed}"

    def __str__(self) -> str:
        """Return a sentence, as ``standing: no sign is seen``."""
        return f"{self.state()}: {self.explanation}"


def seconds_to_renew(left_s: float) -> int | None:
    """Return the whole seconds to warn of, if what drives must be shown again soon, in ``left_s``; else None."""
    return math.ceil(left_s) if 0.0 < left_s <= RENEW_WARNING_S else None


def warned(explanation: str, renew_s: int | None) -> str:
    """Return ``explanation`` with the warning that what drives must change within ``renew_s`` seconds, if any."""
    return explanation if renew_s is None else f"{explanation}; stops in {renew_s} s unless it changes"
