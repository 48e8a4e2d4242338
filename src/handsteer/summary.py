"""Statistics of a run."""

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from handsteer.clock import RealClock
from handsteer.types import CourseState, Pose2D

if TYPE_CHECKING:
    from handsteer.graph import Graph


@dataclass(frozen=True)
class Summary:
    """Statistics of a run.

    Attributes:
        duration_s: Length of the run.
        frames: Frames from the camera.
        fps: Frames per second.
        latency_median_ms: From the capture of a frame to the resulting Twist; None if the clock was stepped.
        latency_p99_ms: The 99th percentile of the same.
        signs: Number of frames per confirmed sign, including ``NONE``.
        final_pose: The robot's actual pose in the world; a real one's odometry. None if unknown.
        odometry: The robot's pose from odometry; None if unknown.
        path_length_m: Distance driven.
        contacts: How often it has begun to touch an obstacle; None for a real one.
        course: Gates, bumps and time on its world's course, with the score in seconds; None if there is no course.
        trouble: What was wrong with the robot at the end, such as ``is not there: …``; empty if nothing.
        callback_errors: Number of failed callbacks.
    """

    duration_s: float
    frames: int
    fps: float
    latency_median_ms: float | None
    latency_p99_ms: float | None
    signs: dict[str, int]
    final_pose: Pose2D | None
    odometry: Pose2D | None
    path_length_m: float
    contacts: int | None
    course: CourseState | None
    trouble: str
    callback_errors: int

    def as_dict(self) -> dict[str, Any]:
        """Return the fields as plain values, for JSON."""
        return {**asdict(self), "course": self.course and self.course.as_dict()}

    @classmethod
    def of(cls, graph: "Graph", duration_s: float) -> "Summary":
        """Return the statistics of a graph that has run for ``duration_s`` seconds."""
        latency, robot = graph.control.latency, graph.robot
        state = robot.state
        is_measured = isinstance(graph.clock, RealClock) and len(latency) > 0
        return cls(
            duration_s=duration_s,
            frames=graph.camera.frames,
            fps=graph.camera.frames / duration_s if duration_s else 0.0,
            latency_median_ms=latency.percentile_ms(50) if is_measured else None,
            latency_p99_ms=latency.percentile_ms(99) if is_measured else None,
            signs=dict(graph.recognition.counts),
            final_pose=state.truth if robot.was_located else None,
            odometry=state.odometry if robot.was_located else None,
            path_length_m=robot.path_length_m,
            contacts=state.collisions,
            course=robot.surroundings.course,
            trouble=state.trouble,
            callback_errors=sum(node.callback_errors for node in graph.nodes),
        )
