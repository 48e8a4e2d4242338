"""Which other participants are there, and that they know of this one (DDSI-RTPS 2.5, section 8.5.3)."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from handsteer.transports.dds.rtps import discovery as told
from handsteer.transports.dds.rtps.discovery import Address, ParticipantData
from handsteer.transports.dds.rtps.wire import ANYBODY, ENTITY_UNKNOWN, Data, Submessage

Say = Callable[[bytes, tuple[Address, ...], list[Submessage]], None]
"""Gets a participant's prefix, its addresses, and what is to be said to it."""

LEASE_S = 10.0
_RENEW_S = 3.0
_SEEK_S, _SEEK_AT_LAST_S = 0.05, 5.0
_OTHERS = 200


@dataclass
class Other:
    """Another participant.

    Attributes:
        data: What it tells of itself.
        due_s: When it counts as gone, unless something comes from it.
        is_served: Whether it is on Fast DDS; of others is only kept that they are there.
    """

    data: ParticipantData
    due_s: float
    is_served: bool


class Presence:
    """Keeps the list of others, and tells them that this participant is there.

    Args:
        prefix: This participant's.
        payload: What is told of it.
        seeking: Where to look for those whose address is not known.
        say: Sends something to another.
    """

    def __init__(self, prefix: bytes, payload: bytes, seeking: Iterable[Address], say: Say) -> None:
        self._prefix = prefix
        self._say = say
        self._seeking = tuple(seeking)
        self._sought: frozenset[bytes] = frozenset()
        self._seek_at_s, self._seek_pause_s = 0.0, _SEEK_S
        self._renew_at_s = 0.0
        self.others: dict[bytes, Other] = {}
        self.told = Data(told.SPDP_READER, told.SPDP_WRITER, 1, payload)

    @property
    def served(self) -> list[Other]:
        """Those on Fast DDS."""
        return [other for other in self.others.values() if other.is_served]

    def seek(self, prefixes: Iterable[bytes]) -> None:
        """Look for the participants of these prefixes, which are there, until they answer."""
        sought = frozenset(prefixes)
        if sought - self._sought:
            self._seek_at_s, self._seek_pause_s = 0.0, _SEEK_S
        self._sought = sought

    def heard(self, prefix: bytes, now_s: float) -> None:
        """Note that something has come from a participant."""
        other = self.others.get(prefix)
        if other is not None:
            other.due_s = now_s + other.data.lease_s

    def meet(self, prefix: bytes, data: Data, now_s: float, *, is_served: bool) -> ParticipantData | None:
        """Note what a participant tells of itself; return it when it is new and served."""
        said = told.read_participant(data)
        if said is None or said.prefix != prefix:
            return None
        known = self.others.get(prefix)
        if known is not None:
            known.data, known.due_s = said, now_s + said.lease_s
        elif len(self.others) < _OTHERS:
            self.others[prefix] = Other(said, now_s + said.lease_s, is_served)
            return said if is_served else None
        return None

    def overdue(self, now_s: float) -> list[bytes]:
        """Return the prefixes of those of whom nothing has come for too long."""
        return [prefix for prefix, other in self.others.items() if other.due_s < now_s]

    def tick(self, now_s: float) -> None:
        """Tell others of this participant, where it is time to."""
        if self._is_seeking and now_s >= self._seek_at_s:
            self._seek_at_s = now_s + self._seek_pause_s
            self._seek_pause_s = min(2 * self._seek_pause_s, _SEEK_AT_LAST_S)
            self._say(ANYBODY, self._seeking, [replace(self.told, reader=ENTITY_UNKNOWN)])
        if now_s >= self._renew_at_s:
            self._renew_at_s = now_s + _RENEW_S
            for other in self.served:
                self._say(other.data.prefix, other.data.metatraffic, [self.told])

    def next_s(self) -> list[float]:
        """Return when :meth:`tick` has something to do."""
        return [
            *([self._renew_at_s] if self.served else []),
            *([self._seek_at_s] if self._is_seeking else []),
        ]

    def leave(self) -> None:
        """Tell all others that this participant is gone."""
        payload, inline = told.farewell(self._prefix + told.PARTICIPANT)
        gone = Data(told.SPDP_READER, told.SPDP_WRITER, 2, payload, inline)
        for prefix, other in self.others.items():
            self._say(prefix, other.data.metatraffic, [gone])
        self.others.clear()

    @property
    def _is_seeking(self) -> bool:
        return any(prefix not in self.others for prefix in self._sought)
