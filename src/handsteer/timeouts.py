"""How long each part waits before it stops the robot, in one table; the defaults of parameters are derived from it.

The sum along the chain matters: from any failure to a zero velocity it is at most 0.5 s.
"""

from typing import Final

STALE_S: Final = 0.35
"""Older frames, signs and steering commands are ignored. In seconds, as all that follow."""

HOLD_TIMEOUT_S: Final = 0.3
"""Steering from the page or from another program ends when it has not been repeated for this long."""

ROBOT_S: Final = 0.4
"""A robot without commands for this long brakes on its own; longer than :data:`STALE_S`, so that a zero comes first."""

ODOMETRY_S: Final = 0.4
"""Without odometry for this long, the robot is considered absent."""

FAULT_GAP_S: Final = 0.3
"""A ``NONE`` this long after the previous sign was caused by a fault: no frame was processed. Recognition keeps this
interval between those that it publishes without frames; those for frames come with every frame."""

NEUTRAL_S: Final = 0.5
"""A picture without a hand is neutral after this time: longer than a hand is missed for a few frames, or a sign takes
to be confirmed."""

MOST_OF_ONE_NONE_S: Final = 0.1
"""Maximum share of one ``NONE`` in that time, however long after the previous sign it arrives."""

ARMING_S: Final = 1.0
"""The control does not arm earlier after its start, so that other nodes can report a Stop."""

HEAR_STOP_S: Final = 3.0
"""A control that starts waits no longer than this to hear from other nodes whether a Stop stands. Over Fast DDS, what a
node has published before it arrives up to 2.2 s after the start (measured over 8 starts)."""

DISTRUST_S: Final = 0.1
"""For this long after a stall of the process, messages may still come from sockets and queues, and are ignored."""

RECORDED_S: Final = 5.0
"""No link delays frames by so much: older ones are from a recording, or from an unsynchronized clock."""

PLAYED_S: Final = 1.0
"""A player of recordings that sends nothing for this long has paused or ended. Shorter gaps are those of a busy
machine, in which the control stops, as without any sign."""

BURST_S: Final = 0.01
"""Messages at shorter intervals, from the moment a process continues, have been waiting, however long a busy machine
takes to deliver them; no camera and no node sends so fast."""

RESYNC_S: Final = 1.0
"""How long frames are observed after their clock was set, before its new offset is used."""

NOT_FOLLOWING_S: Final = 1.0
"""A robot that does not move for this long after a command does not follow."""

STOOD_BY_ITSELF_S: Final = 0.1
"""A robot that was following, and stops for this long in spite of commands, does not receive them."""

OPPOSES_S: Final = 0.4
"""A robot that moves against its command for this long is not under control; :data:`NOT_FOLLOWING_S` if it moved so
when the command came, as a robot that is turned round has to brake first."""

ENGAGE_S: Final = 1.0
"""An open palm held for this long engages the hand (``control.engage``)."""

DISENGAGE_S: Final = 5.0
"""Without a sign for this long, the hand is disengaged."""

RENEW_S: Final = 20.0
"""A sign or stick that drives without any change for this long has to be shown again (``control.renew``)."""

RENEW_WARNING_S: Final = 5.0
"""So long before, the driver is warned."""
