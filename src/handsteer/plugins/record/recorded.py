"""Recorded messages, and what contains them."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from handsteer.errors import RecordingError
from handsteer.transports.encoding import decode, types

_NS_PER_S = 1_000_000_000


@dataclass(frozen=True)
class Recorded:
    """A message of a recording.

    Attributes:
        topic: Full name of its topic.
        type: Name of its type, as ``std_msgs/msg/String``; empty if the recording does not name it.
        time_ns: When it was received, in ns since the epoch of the recording's clock.
        number: Its number among the messages of the topic, as :class:`~handsteer.transports.base.Received`; 0 if
            unknown.
        raw: The message as CDR.
    """

    topic: str
    type: str
    time_ns: int
    number: int
    raw: bytes

    @property
    def time_s(self) -> float:
        """When it was received, in seconds."""
        return self.time_ns / _NS_PER_S

    @property
    def message(self) -> Any:
        """The message.

        Raises:
            RecordingError: Its type is not known here, or its data is damaged.
        """
        if self.type not in types().fielddefs:
            raise RecordingError(f"{self.topic}: messages of the type {self.type[:60]!r} are not known")
        try:
            return decode(self.raw, self.type)
        except Exception as error:
            raise RecordingError(f"{self.topic}: a damaged message of {self.type}: {error}") from None


class Recording(ABC):
    """A recording that can be read.

    Args:
        path: The file or folder.

    Attributes:
        path: The same.
        about: The metadata that handsteer writes (:func:`handsteer.plugins.record.describe`); empty in those of others.
        problem: Why it was not read to its end; None if it was, or was not read yet.
        is_damaged: Whether a part between others could not be read, of what was read so far.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.about: dict[str, str] = {}
        self.problem: str | None = None
        self.is_damaged = False

    @cached_property
    def began_s(self) -> float:
        """The time of the first message, in seconds since the epoch of its stamps; 0 if there is none."""
        return next((recorded.time_s for recorded in self.messages()), 0.0)

    @abstractmethod
    def messages(self, topics: Collection[str] | None = None) -> Iterator[Recorded]:
        """Yield the messages of ``topics``, of all by default, in the order in which they were written."""
