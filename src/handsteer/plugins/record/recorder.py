"""Records the topics of a graph to a file while the graph runs: those of this process, or of several."""

import itertools
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from handsteer.clock import Clock
from handsteer.config import Config, cmd_vel_type
from handsteer.images import bgr_image, jpeg_message
from handsteer.messages import (
    IMAGE_COMPRESSED,
    IMAGE_RAW,
    RECORDED,
    SCAN,
    CompressedImage,
    Image,
    String,
    Topic,
    cmd_vel,
)
from handsteer.plugins.record.files import describe
from handsteer.plugins.record.mcap_writer import McapWriter
from handsteer.transports.base import Received, Transport
from handsteer.transports.encoding import encode

_NODE = "recorder"
# Short, because the other threads wait while messages are encoded.
_WRITE_PERIOD_S = 0.03
_CUT_PERIOD_S = 0.5
# A disk may hang for seconds; a graph publishes some 250 messages a second, 30 of them pictures.
_MOST_WAITING = 5000
_MOST_PICTURES_WAITING = 150
# Nodes of other processes appear late.
_DECIDES_AFTER_S = 3.0

log = logging.getLogger(__name__)


class Recorder:
    """Writes every message of some topics to an MCAP file, on a thread of its own.

    Publishers never wait for the disk. If it cannot keep up, the newest messages are left out and counted; if it is
    full, the recording ends and the graph goes on.

    Args:
        path: The file, which must not exist yet.
        transport: Carries the messages.
        clock: The graph's clock, for the times of the messages.
        topics: What to record.
        about: Metadata of the file: the configuration, versions and so on.
        waits: Whether a publisher waits for the disk; for a stepped run, which is faster than a disk.
        on_failure: Called when a failure has ended the recording, on the thread that writes.

    Attributes:
        path: The file.
        lost: Number of messages that were left out.
        ended_by: Why the recording has ended before :meth:`close`; None if it has not.

    Raises:
        RecordingError: The file exists or cannot be created.
    """

    def __init__(
        self,
        path: Path,
        transport: Transport,
        clock: Clock,
        topics: Sequence[Topic[Any]],
        about: Mapping[str, str],
        *,
        waits: bool = False,
        on_failure: Callable[[], None] = lambda: None,
    ) -> None:
        self.path = path
        self.lost = 0
        self.ended_by: str | None = None
        self._transport = transport
        self._clock = clock
        self._waits = waits
        self._on_failure = on_failure
        self._file = McapWriter(path)
        self._file.describe("handsteer", about)
        self._waiting: deque[tuple[Topic[Any], str, Any, int, int]] = deque()
        self._pictures = 0
        self._lock = threading.Lock()
        self._writing = threading.Lock()
        self._cut_s = time.monotonic()
        self._ended = threading.Event()
        self._subscriptions = ExitStack()
        for topic in topics:
            self.listen(topic)
        self._thread = threading.Thread(target=self._run, name=_NODE, daemon=True)
        self._thread.start()

    def note(self, topic: Topic[String], text: str) -> None:
        """Record ``text`` as a message of ``topic``, which no node publishes."""
        self._put(topic, topic.name, String(data=text), 0)

    def close(self) -> None:
        """Write what waits, and close the file; may be called twice."""
        self._subscriptions.close()
        self._ended.set()
        self._thread.join()
        if self.ended_by is None:
            self._write(is_end=True)
        if self.lost:
            log.warning("%s lacks %d messages: the disk was too slow", self.path, self.lost)

    def listen(self, topic: Topic[Any]) -> None:
        """Record ``topic`` too; raw images are recorded as JPEG, on the topic of the compressed ones."""
        kept = IMAGE_COMPRESSED if topic is IMAGE_RAW else topic
        name = self._transport.topic_name(kept)
        # Transports to other processes do not count messages.
        numbers = itertools.count(1)

        def deliver(received: Received[Any]) -> None:
            self._put(kept, name, received.message, received.number or next(numbers))

        self._subscriptions.callback(self._transport.subscribe(_NODE, topic, deliver).close)

    def _put(self, topic: Topic[Any], name: str, message: Any, number: int) -> None:
        if self._ended.is_set():
            return
        stamp = self._clock.stamp(self._clock.now())
        is_picture = topic.type is CompressedImage
        with self._lock:
            if len(self._waiting) >= _MOST_WAITING or (is_picture and self._pictures >= _MOST_PICTURES_WAITING):
                self.lost += 1
                return
            self._pictures += is_picture
            self._waiting.append((topic, name, message, stamp.sec * 1_000_000_000 + stamp.nanosec, number))
            is_full = self._waits and len(self._waiting) > _MOST_PICTURES_WAITING // 2
        if is_full:
            self._write()

    def _run(self) -> None:
        while not self._ended.wait(_WRITE_PERIOD_S):
            self._write()

    def _write(self, *, is_end: bool = False) -> None:
        with self._writing:
            if self.ended_by is not None:
                return
            try:
                self._write_waiting()
                if is_end:
                    self._file.close()
                elif time.monotonic() - self._cut_s >= _CUT_PERIOD_S:
                    self._cut_s = time.monotonic()
                    self._file.cut()
            except OSError as error:
                self.ended_by = f"{error.strerror or error}"
                self._ended.set()
                with suppress(OSError):
                    self._file.close()
                log.warning("the recording to %s has ended: %s; driving goes on", self.path, self.ended_by)
                self._on_failure()

    def _write_waiting(self) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    return
                topic, name, message, time_ns, number = self._waiting.popleft()
                self._pictures -= topic.type is CompressedImage
            try:
                if isinstance(message, Image):
                    message = jpeg_message(bgr_image(message), message.header)
                raw = encode(message)
            except Exception as error:
                log.warning("a message on %s cannot be recorded: %s", name, error)
                continue
            self._file.write(topic, name, raw, time_ns, number)


class GraphRecorder(Recorder):
    """Records a graph of several processes that this one has joined.

    Pictures are taken from ``/image_raw/compressed`` if a node publishes that, else from ``/image_raw``.

    Args:
        path: The file, which must not exist yet.
        transport: Carries the messages.
        clock: The graph's clock.
        config: Names the type of the commands, and whether laser scans are used.

    Raises:
        RecordingError: The file exists or cannot be created.
    """

    def __init__(self, path: Path, transport: Transport, clock: Clock, config: Config) -> None:
        scans = (SCAN,) if config.uses_scans else ()
        topics = (*RECORDED, cmd_vel(cmd_vel_type(config)), *scans)
        super().__init__(path, transport, clock, topics, describe(None, clock, ()))
        self._decides_s: float | None = time.monotonic() + _DECIDES_AFTER_S

    def look(self) -> None:
        """Decide which pictures to record, once it is known who publishes; call it several times a second."""
        if self._decides_s is None:
            return
        publishers_of = self._transport.publishers_of
        if publishers_of(IMAGE_COMPRESSED):
            self.listen(IMAGE_COMPRESSED)
        elif publishers_of(IMAGE_RAW) and time.monotonic() > self._decides_s:
            name = self._transport.topic_name(IMAGE_RAW)
            log.info("no node publishes compressed pictures: those of %s are recorded as JPEG", name)
            self.listen(IMAGE_RAW)
        else:
            return
        self._decides_s = None
