"""Publishes /clock, from the second in its argument on, until it is killed."""

import sys
import time

import rospy
from rosgraph_msgs.msg import Clock


def main() -> None:
    rospy.init_node("time_server", disable_signals=True)
    publisher = rospy.Publisher("/clock", Clock, queue_size=1)
    offset_s = float(sys.argv[1]) - time.monotonic()
    while True:
        publisher.publish(Clock(clock=rospy.Time.from_sec(offset_s + time.monotonic())))
        time.sleep(0.01)


if __name__ == "__main__":
    main()
