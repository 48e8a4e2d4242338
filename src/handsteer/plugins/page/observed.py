"""What the page has received: the newest reports and figures, and what its viewers do; pure data."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal, TypeVar

from handsteer.control.explain import Reason
from handsteer.nodes.status import CameraStatus, ControlStatus, RecognitionStatus, RobotStatus, Status
from handsteer.timeouts import ODOMETRY_S
from handsteer.types import NONE, STOP, ZERO, Velocity

S = TypeVar("S", bound=Status)

STALE_S: Final = 2.0
"""A node that has not reported for this long counts as silent; the slowest reports twice a second."""


@dataclass(frozen=True)
class Report:
    """The last report of a node on ``/diagnostics``, and its time of arrival in seconds of the graph's clock."""

    status: Status
    came_s: float


Task = Literal["", "the lesson", "the calibration", "the lap", "the world editor"]
"""What a viewer does on the page for which the robot is stopped; empty if none."""

Person = Literal["", "you", "another viewer"]
"""A viewer, as seen by one of them; empty if none."""


@dataclass(frozen=True)
class Viewers:
    """The viewers' activity, as seen by one of them.

    Attributes:
        steers: The viewer who steers.
        steered: The viewer who steers, or did a moment ago, when the control's report may be older.
        stopped: The viewer who pressed Stop last.
        stopped_for: What the page has stopped the robot for, where no viewer pressed Stop.
        may_reset: Whether this viewer may reset Stop.
        topic: The topic of steering that bypasses the control; empty otherwise.
        stands: Whether steering is disabled by Stop; used if no control reports Stop.
        waits: Whether what steers has to be released first.
    """

    steers: Person = ""
    steered: Person = ""
    stopped: Person = ""
    stopped_for: Task = ""
    may_reset: bool = True
    topic: str = ""
    stands: bool = False
    waits: bool = False


NO_VIEWERS = Viewers()


@dataclass(frozen=True)
class Observed:
    """The newest of everything that the page shows in figures.

    Attributes:
        reports: The last report of each node, by the type of its status.
        command: The last velocity command.
        command_came_s: Its time of arrival in seconds of the graph's clock.
        measured: The velocity from odometry.
        measured_came_s: Its time of arrival, likewise.
        frame_counts: Times and frame counters of the camera's last reports, oldest first.
    """

    reports: Mapping[type[Status], Report] = field(default_factory=dict)
    command: Velocity = ZERO
    command_came_s: float = -math.inf
    measured: Velocity = ZERO
    measured_came_s: float = -math.inf
    frame_counts: Sequence[tuple[float, float]] = ()

    def is_moving(self, now_s: float) -> bool:
        """Return whether the robot is measured to move at ``now_s``."""
        return now_s - self.measured_came_s < ODOMETRY_S and not self.measured.is_rest

    def last(self, kind: type[S], since_s: float = -math.inf) -> S | None:
        """Return the last status of this type; None if it was not reported at ``since_s`` or later."""
        report = self.reports.get(kind)
        if report is None or report.came_s <= since_s or not isinstance(report.status, kind):
            return None
        return report.status


@dataclass(frozen=True)
class Reporting:
    """The status of each node that reports; None for one that is silent."""

    camera: CameraStatus | None = None
    recognition: RecognitionStatus | None = None
    control: ControlStatus | None = None
    robot: RobotStatus | None = None

    @classmethod
    def at(cls, now_s: float, observed: Observed) -> "Reporting":
        """Return the nodes that report at ``now_s``, in seconds of the graph's clock."""
        since_s = now_s - STALE_S
        return cls(
            observed.last(CameraStatus, since_s),
            observed.last(RecognitionStatus, since_s),
            observed.last(ControlStatus, since_s),
            observed.last(RobotStatus, since_s),
        )


def caught_up(reporting: Reporting, observed: Observed) -> Reporting:
    """Return ``reporting`` with what the control has commanded since its report, as far as that explains itself.

    A report is up to 0.1 s old, on a busy machine more. Next to a command to drive, it must not say that the robot is
    steered at zero.
    """
    control, recognition, command = reporting.control, reporting.recognition, observed.command
    reported = observed.reports.get(ControlStatus)
    # Where another node commands the robot too, the control warns of it: the command may be that of the other.
    if control is None or reported is None or control.stopped or control.warning:
        return reporting
    if control.linear_mps or control.angular_radps or command.is_zero or observed.command_came_s <= reported.came_s:
        return reporting
    points = control.rule is not None and control.rule.points
    by_hand = Reason("pointed" if points else "joystick")
    reason = {"steering": Reason("steered"), "joystick": by_hand}.get(control.source)
    if control.source == "signs" and recognition is not None and recognition.sign not in (NONE, STOP):
        reason = Reason("sign", recognition.sign)
    if reason is None:
        return reporting
    control = replace(control, reason=reason, linear_mps=command.linear_mps, angular_radps=command.angular_radps)
    return replace(reporting, control=control)
