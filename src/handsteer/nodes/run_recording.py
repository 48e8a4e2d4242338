"""Records a run: all topics, and the journals of the nodes that a replay runs again."""

import functools
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handsteer.audit import INFO, WARN, AuditCode, AuditEvent
from handsteer.clock import Clock, SteppedClock
from handsteer.errors import RecordingError
from handsteer.messages import RECORDED, Topic
from handsteer.nodes.auditing import Auditor
from handsteer.nodes.base import Node
from handsteer.nodes.journal import journal_topic
from handsteer.plugins.record.folder import RecordingState
from handsteer.transports.base import Transport

if TYPE_CHECKING:
    from handsteer.plugins.record.recorder import Recorder


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

    def start(self, path: Path, about: Mapping[str, str], by: str, prepare: Callable[[], None]) -> None:
        """Record to ``path`` from now on.

        Args:
            path: The file, which must not exist yet.
            about: Its metadata.
            by: Who starts it.
            prepare: Called once the file exists, before journals begin.

        Raises:
            RecordingError: The file cannot be created, or another recording is being made.
        """
        with self._lock:
            if self._recorder is not None and self._recorder.ended_by is None:
                raise RecordingError(f"{self._recorder.path} is being recorded: end that first")
            self.end(by)
            self._recorder = self._open(path, about, prepare)
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

    def _open(self, path: Path, about: Mapping[str, str], prepare: Callable[[], None]) -> "Recorder":
        # Only recordings need the package mcap.
        from handsteer.plugins.record.recorder import Recorder  # noqa: PLC0415

        waits = isinstance(self._clock, SteppedClock)
        topics = (*RECORDED, *self._topics)
        recorder = Recorder(path, *self._wires, topics, about, waits=waits, on_failure=self._on_failure)
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

    def _note_end(self, recorder: "Recorder") -> None:
        if self.state is not None:
            ended_s = self._clock.now() if self.state.ended_s is None else self.state.ended_s
            self.state = replace(self.state, ended_s=ended_s, ended_by=recorder.ended_by or "", lost=recorder.lost)

    def _tell(self, code: AuditCode, sentence: str, by: str, level: int = INFO) -> None:
        assert self.state is not None
        self._auditor.say(AuditEvent(code, by, sentence, self.state.path.name, level), self._clock.now())
        self.on_change()
