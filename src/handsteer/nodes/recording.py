"""Frames of a recording, which are stamped by another day's clock, and frames that only come late."""

import logging

from handsteer.config import Recorded
from handsteer.timeouts import RECORDED_S, RESYNC_S, STALE_S

log = logging.getLogger(__name__)


class Recording:
    """Tells whether frames are a recording's, which count as captured when they come.

    A stamp alone does not tell: frames of a camera whose link is slow are stale, too, and whoever stands before it must
    not move a robot by what he did before. So by itself this follows what a player of recordings publishes, and nothing
    else. What is stamped long ago and comes in step it takes for a recording that somebody may want to be followed, and
    says so.

    Args:
        recorded: auto follows what a player publishes; always follows also what is stamped longer ago than any link
            delays; never follows nothing.
        limit_s: Frames that are no older, in seconds, are nobody's recording.

    Attributes:
        limit_s: As above; may be changed.
        is_followed: Whether the last frame was a recording's, and is to count.
    """

    def __init__(self, recorded: Recorded, limit_s: float) -> None:
        self._recorded = recorded
        self.limit_s = limit_s
        self.is_followed = False
        self._captured_s: float | None = None
        self._in_step_since: tuple[float, float] | None = None
        self._said = False

    def follows(self, now_s: float, captured_s: float, *, by_player: bool) -> bool:
        """Note a frame; return whether it is a recording's, and is to count as captured now.

        Args:
            now_s: The time now, in seconds of the graph's clock.
            captured_s: The frame's stamp, in seconds of the same clock.
            by_player: Whether a player of recordings published it, as far as is known.
        """
        age_s = now_s - captured_s
        stands, self._captured_s = captured_s == self._captured_s, captured_s
        self._note_step(now_s, age_s)
        meant = by_player if self._recorded == "auto" else self._recorded == "always"
        long_ago = age_s > (self.limit_s if by_player else RECORDED_S)
        # A stamp that stands still is that of a camera, or of a clock, that has failed.
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
    """Return a duration as people say it, as ``3 days``."""
    for unit, length_s in (("years", 31_557_600.0), ("days", 86_400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2 * length_s:
            return f"{seconds / length_s:.0f} {unit}"
    return f"{seconds:.0f} s"
