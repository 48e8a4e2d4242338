"""Distinguishes frames of a recording, which have old stamps, from frames that arrive late."""

import logging

from handsteer.config import Recorded
from handsteer.timeouts import RECORDED_S, RESYNC_S, STALE_S

log = logging.getLogger(__name__)


class Recording:
    """Decides whether frames come from a recording; these count as captured on arrival.

    The stamp alone is not enough: frames over a slow camera link are old too, and old gestures must not move a robot.
    So ``auto`` accepts only what a player of recordings publishes. Frames with old stamps that advance in step with
    time are reported as a possible recording.

    Args:
        recorded: auto accepts what a player publishes; always accepts also stamps older than any link delay; never
            accepts nothing.
        limit_s: Frames that are no older than this, in seconds, are not a recording's.

    Attributes:
        limit_s: As above; may be changed.
        is_followed: Whether the last frame was accepted as a recording's.
    """

    def __init__(self, recorded: Recorded, limit_s: float) -> None:
        self._recorded = recorded
        self.limit_s = limit_s
        self.is_followed = False
        self._captured_s: float | None = None
        self._in_step_since: tuple[float, float] | None = None
        self._said = False

    def follows(self, now_s: float, captured_s: float, *, by_player: bool) -> bool:
        """Record a frame; return whether it is accepted as a recording's, captured now.

        Args:
            now_s: Current time, in seconds of the graph's clock.
            captured_s: The frame's stamp, in seconds of the same clock.
            by_player: Whether a player of recordings is known to publish it.
        """
        age_s = now_s - captured_s
        stands, self._captured_s = captured_s == self._captured_s, captured_s
        self._note_step(now_s, age_s)
        meant = by_player if self._recorded == "auto" else self._recorded == "always"
        long_ago = age_s > (self.limit_s if by_player else RECORDED_S)
        # A stamp that does not advance comes from a camera or clock that has failed.
        self.is_followed = meant and long_ago and not stands
        if self.is_followed:
            self._say(logging.INFO, f"frames are stamped {in_words(age_s)} ago: they are followed, as a recording's")
        return self.is_followed

    def hint(self, now_s: float) -> str | None:
        """Return what to do if the last frames, which were refused, are a recording's; None if they cannot be."""
        if self._in_step_since is None or self._recorded == "always":
            return None
        since_s, age_s = self._in_step_since
        if age_s <= RECORDED_S or now_s - since_s < RESYNC_S:
            return None
        hint = (
            f"frames are stamped {in_words(age_s)} ago, and come in step: if they are a recording's, set the parameter "
            "recorded to always, or play it with --clock and use_sim_time; else the clocks of machines are not in step"
        )
        self._say(logging.WARNING, hint)
        return hint

    def _note_step(self, now_s: float, age_s: float) -> None:
        if self._in_step_since is None or abs(age_s - self._in_step_since[1]) > STALE_S:
            self._in_step_since = (now_s, age_s)

    def _say(self, level: int, message: str) -> None:
        if not self._said:
            log.log(level, message)
        self._said = True


def in_words(seconds: float) -> str:
    """Return a duration in words, such as ``3 days``."""
    for unit, length_s in (("years", 31_557_600.0), ("days", 86_400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2 * length_s:
            return f"{seconds / length_s:.0f} {unit}"
    return f"{seconds:.0f} s"
