"""Records a run: all topics, and the journals of the nodes that a replay runs again."""

import functools
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from handsteer import doors
from handsteer.audit import INFO, WARN, AuditCode, AuditEvent
from handsteer.clock import Clock, SteppedClock
from handsteer.config import Config
from handsteer.errors import RecordingError
from handsteer.messages import RECORDED, String, Topic
from handsteer.nodes.auditing import Auditor
from handsteer.nodes.base import Node
from handsteer.nodes.journal import JOURNALS, journal_topic
from handsteer.transports.base import Transport

_RECORDER = "mcap"


class Recorder(Protocol):
    """Writes topics to a file.

    Attributes:
        path: The file.
        lost: Number of messages that were left out.
        ended_by: Why the recording has ended before :meth:`close`; None if it has not.
    """

    path: Path
    lost: int
    ended_by: str | None

    def note(self, topic: Topic[String], text: str) -> None:
        """Record ``text`` as a message of ``topic``, which no node publishes."""
        ...

    def close(self) -> None:
        """Write what waits, and close the file; may be called twice."""
        ...


@dataclass(frozen=True)
class RecordingState:
    """A recording of a graph.

    Attributes:
        path: The file.
        began_s: When it began, in seconds of the graph's clock.
        ended_s: When it ended; None while it is being made.
        ended_by: Which failure ended it, such as a full disk; empty if none did.
        lost: Number of messages that are missing because the disk was too slow.
    """

    path: Path
    began_s: float
    ended_s: float | None = None
    ended_by: str = ""
    lost: int = 0


class RunRecording:
    """Starts and ends recordings, one at a time; all methods may be called from any thread.

    Args:
        transport: Carries the messages.
        clock: The graph's clock.
        auditor: Publishes who starts and ends recordings.
        nodes: Nodes with a journal.
        topics: What to record besides the topics of every recording.

    Attributes:
        state: The recording that is being made, or the last one; None if there was none.
        on_change: Called when ``state`` has changed, on any thread.
    """

    def __init__(
        self, transport: Transport, clock: Clock, auditor: Auditor, nodes: Sequence[Node], topics: Sequence[Topic[Any]]
    ) -> None:
        self.state: RecordingState | None = None
        self.on_change: Callable[[], None] = lambda: None
        self._wires = (transport, clock)
        self._clock = clock
        self._auditor = auditor
        self._nodes = nodes
        self._topics = topics
        self._recorder: Recorder | None = None
        self._lock = threading.RLock()

    def start(self, path: Path, config: Config, models: Sequence[Path], by: str, prepare: Callable[[], None]) -> None:
        """Record to ``path`` from now on.

        Args:
            path: The file, which must not exist yet.
            config: The parameters of all nodes, for the file's metadata.
            models: The model files of the recognition, likewise.
            by: Who starts it.
            prepare: Called once the file exists, before journals begin.

        Raises:
            RecordingError: The file cannot be created, or another recording is being made.
            PluginError: What records cannot be loaded.
        """
        with self._lock:
            if self._recorder is not None and self._recorder.ended_by is None:
                raise RecordingError(f"{self._recorder.path} is being recorded: end that first")
            self.end(by)
            self._recorder = self._open(path, config, models, prepare)
            self.state = RecordingState(path, self._clock.now())
            self._tell("recording_started", f"started the recording {path.name}", by)

    def end(self, by: str) -> None:
        """End the recording, if there is one; ``by`` is who ends it."""
        with self._lock:
            if self._recorder is None:
                return
            if self._recorder.ended_by is None:
                self._tell("recording_ended", f"ended the recording {self._recorder.path.name}", by)
            recorder, self._recorder = self._recorder, None
            for node in self._nodes:
                assert node.journal is not None
                node.journal.write_to(None)
            recorder.close()
            self._note_end(recorder)
        self.on_change()

    def _open(self, path: Path, config: Config, models: Sequence[Path], prepare: Callable[[], None]) -> Recorder:
        recorder: Recorder = doors.RECORDERS.load(_RECORDER)(
            path,
            *self._wires,
            (*RECORDED, *self._topics),
            config=config,
            models=models,
            about={JOURNALS: "yes"},
            waits=isinstance(self._clock, SteppedClock),
            on_failure=self._on_failure,
        )
        prepare()
        for node in self._nodes:
            assert node.journal is not None
            node.journal.write_to(functools.partial(recorder.note, journal_topic(node.name)))
        return recorder

    def _on_failure(self) -> None:
        recorder = self._recorder
        if recorder is not None:
            self._note_end(recorder)
            sentence = f"the recording {recorder.path.name} has ended: {recorder.ended_by}; driving goes on"
            self._tell("recording_ended", sentence, self._auditor.who, WARN)

    def _note_end(self, recorder: Recorder) -> None:
        if self.state is not None:
            ended_s = self._clock.now() if self.state.ended_s is None else self.state.ended_s
            self.state = replace(self.state, ended_s=ended_s, ended_by=recorder.ended_by or "", lost=recorder.lost)

    def _tell(self, code: AuditCode, sentence: str, by: str, level: int = INFO) -> None:
        assert self.state is not None
        self._auditor.say(AuditEvent(code, by, sentence, self.state.path.name, level), self._clock.now())
        self.on_change()
