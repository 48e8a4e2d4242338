"""Records the topics of a graph of several processes, as one more of its nodes."""

import logging
import time
from pathlib import Path

from handsteer.config import Config, cmd_vel_type
from handsteer.messages import IMAGE_COMPRESSED, IMAGE_RAW, RECORDED, cmd_vel
from handsteer.recordings.about import describe
from handsteer.recordings.recorder import Recorder
from handsteer.transports.base import Session

# Nodes of other processes appear late.
_DECIDES_AFTER_S = 3.0

log = logging.getLogger(__name__)


class GraphRecorder:
    """Records a graph that this process has joined.

    Pictures are taken from ``/image_raw/compressed`` if a node publishes that, else from ``/image_raw``.

    Args:
        path: The file, which must not exist yet.
        session: This process in the graph.
        config: Names the type of the commands, and whether laser scans are used.

    Raises:
        RecordingError: The file exists or cannot be created.
    """

    def __init__(self, path: Path, session: Session, config: Config) -> None:
        self._session = session
        commands = cmd_vel(cmd_vel_type(config))
        about = describe(None, session.clock, ())
        self._recorder = Recorder(path, session.transport, session.clock, (*RECORDED, commands), about)
        self._decides_s: float | None = time.monotonic() + _DECIDES_AFTER_S

    @property
    def ended_by(self) -> str | None:
        """Why the recording has ended before :meth:`close`; None if it has not."""
        return self._recorder.ended_by

    def look(self) -> None:
        """Decide which pictures to record, once it is known who publishes; call it several times a second."""
        if self._decides_s is None:
            return
        publishers_of = self._session.transport.publishers_of
        if publishers_of(IMAGE_COMPRESSED):
            self._recorder.listen(IMAGE_COMPRESSED)
        elif publishers_of(IMAGE_RAW) and time.monotonic() > self._decides_s:
            name = self._session.transport.topic_name(IMAGE_RAW)
            log.info("no node publishes compressed pictures: those of %s are recorded as JPEG", name)
            self._recorder.listen(IMAGE_RAW)
        else:
            return
        self._decides_s = None

    def close(self) -> None:
        """Write what waits, and close the file; may be called twice."""
        self._recorder.close()
