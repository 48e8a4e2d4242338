"""The signs, by the names that travel on ``/gesture/hand_sign``; all from the user's own point of view."""

STOP = "Stop"
FORWARD = "Forward"
BACKWARD = "Backward"
TURN_RIGHT = "Turn Right"
TURN_LEFT = "Turn Left"
GO = "Go"
NONE = "NONE"
"""No hand, or a hand that shows none of the signs."""

SIGNS = (STOP, FORWARD, BACKWARD, TURN_RIGHT, TURN_LEFT, GO)
MOTION_SIGNS = frozenset({FORWARD, BACKWARD, TURN_RIGHT, TURN_LEFT})
"""The signs that can make a robot move."""
