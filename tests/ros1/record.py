"""Run by Debian's Python, which has rospy: prints one JSON line for each message of the topics in its argument.

A message becomes the numbers that the tests look at; ``at_s`` is its arrival on the machine's monotonic clock, which
all processes share, ``stamp_s`` the time in its header.
"""

import json
import math
import sys
import time
from typing import Any

import roslib.message
import rospy


def numbers(message: Any) -> dict[str, Any]:
    """Return what there is of velocity, pose, word and stamp in ``message``."""
    found: dict[str, Any] = {}
    header = getattr(message, "header", None)
    if header is not None:
        found.update(stamp_s=header.stamp.to_sec(), frame_id=header.frame_id)
    if isinstance(getattr(message, "data", None), str):
        found["word"] = message.data
    if hasattr(message, "clock"):
        found["clock_s"] = message.clock.to_sec()
    if hasattr(message, "transforms"):
        found["frames"] = [[one.header.frame_id, one.child_frame_id] for one in message.transforms]
    if hasattr(message, "status"):
        found["status"] = {one.name: one.message for one in message.status}
    twist = message.twist.twist if hasattr(message, "pose") else message
    if hasattr(twist, "linear"):
        found.update(linear=twist.linear.x, angular=twist.angular.z)
    if hasattr(message, "pose"):
        pose = message.pose.pose
        yaw = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
        found.update(x=pose.position.x, y=pose.position.y, yaw=math.remainder(yaw, math.tau))
    return found


def say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> None:
    rospy.init_node("recorder", anonymous=True, disable_signals=True)

    def write(message: Any, topic: str) -> None:
        record = {"topic": topic, "at_s": time.monotonic(), **numbers(message)}
        say(json.dumps(record))

    for topic, kind in json.loads(sys.argv[1]).items():
        rospy.Subscriber(topic, roslib.message.get_message_class(kind), write, callback_args=topic)
    say("ready")
    rospy.spin()


if __name__ == "__main__":
    main()
