"""The doors of recordings: as a camera, and of a run."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, closing, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handsteer.cameras import Camera
from handsteer.clock import Clock
from handsteer.config import Config
from handsteer.messages import Topic
from handsteer.transports.base import Transport

if TYPE_CHECKING:
    from handsteer.graph import Graph
    from handsteer.plugins.record.recorder import Recorder


def open_camera(config: Config, clock: Clock) -> Camera:
    """Return the pictures of the recording that ``camera.source`` names, as a camera.

    Raises:
        RecordingError: It cannot be read, or has no pictures.
    """
    from handsteer.plugins.record.camera import RecordingCamera

    return RecordingCamera(Path(config.camera.source).expanduser(), clock, config.camera.at_end)


def open_recorder(
    path: Path,
    transport: Transport,
    clock: Clock,
    topics: Sequence[Topic[Any]],
    *,
    config: Config,
    models: Sequence[Path],
    about: Mapping[str, str],
    waits: bool,
    on_failure: Callable[[], None],
) -> "Recorder":
    """Return a recorder of ``topics`` to the new file ``path``, with the metadata of every recording and ``about``.

    Raises:
        RecordingError: The file exists or cannot be created.
        PackageMissing: The package mcap is not installed.
    """
    from handsteer.plugins.record.files import describe
    from handsteer.plugins.record.recorder import Recorder

    known = {**describe(config, clock, models), **about}
    return Recorder(path, transport, clock, topics, known, waits=waits, on_failure=on_failure)


def write_audit(graph: "Graph", *, is_simulated_time: bool) -> AbstractContextManager[object]:
    """Return what writes the audit of ``graph`` to its log file, if it has one."""
    from handsteer.plugins.record.audit_log import AuditLog, audit_log_path

    path = audit_log_path(graph.config.recording.audit_log, is_simulated_time=is_simulated_time)
    return nullcontext() if path is None else closing(AuditLog(graph.transport, path))
