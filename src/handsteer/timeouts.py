"""How long each part waits before it stops the robot: the one table, from which the defaults of parameters follow.

The sum along the chain is what counts: from whatever fails to a zero velocity it takes at most 0.5 s.
"""

from typing import Final

STALE_S: Final = 0.35
"""A frame, a sign or a steering command that is older than this counts as none, and is not obeyed. In seconds, as all
that follow."""

ROBOT_S: Final = 0.4
"""A robot that hears no command for so long brakes by itself; longer than :data:`STALE_S`, so that it is told first."""

ODOMETRY_S: Final = 0.45
"""Odometry that comes no more for so long tells that the robot is not there."""

FAULT_GAP_S: Final = 0.3
"""A ``NONE`` that comes so long after the sign before it was made by a fault: no frame was looked at. Recognition keeps
this distance between those that it makes by itself; those that were seen come with every frame."""

NEUTRAL_S: Final = 0.5
"""An empty picture is neutral when it has been seen for so long: more than a hand that is missed for a few frames, or a
sign that is not confirmed yet."""

MOST_OF_ONE_NONE_S: Final = 0.1
"""What one ``NONE`` counts of that, however long after the sign before it comes."""

ARMING_S: Final = 1.0
"""After its start the control arms no earlier, so that it has heard from others whether the robot was stopped."""

STEERING_AT_START_S: Final = 2.0
"""Steering that is first heard later than this after the start was not held before it."""

HELD_UP_S: Final = 0.1
"""How long after a process was held up messages may still come out of sockets and queues, and are not obeyed."""

RECORDED_S: Final = 5.0
"""No link delays frames by so much: what is older is a recording, or was stamped by a clock that is not in step."""

BURST_S: Final = 0.01
"""Messages that follow one another faster than this, from the moment at which a process went on, have waited, however
long a busy machine takes to bring them; no camera and no node sends so fast."""

RESYNC_S: Final = 1.0
"""How long frames are watched after their clock was set, before they are timed by it anew."""

NOT_FOLLOWING_S: Final = 1.0
"""A robot that stands for so long after it was told to move does not follow."""

STOOD_BY_ITSELF_S: Final = 0.1
"""A robot that has followed, and then stands for so long though it is told to move, does not hear what it is told."""
