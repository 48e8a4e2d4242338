"""``control.assist: steer``: drives around what is in the way, as near as it can to what the person wants.

Of the velocities that the robot can reach soon, ``steer`` chooses the nearest to the wish whose path keeps clear; the
collision monitor then slows whatever still leads to an obstacle (:doc:`/safety`).

Imports the kernel only.
"""
