"""Run by Debian's Python, which has rospy: publishes /clock from 1000 s on, as fast as real time, until it is killed."""

import time

import rospy
from rosgraph_msgs.msg import Clock

START_S = 1000.0


def main() -> None:
    rospy.init_node("time_server", disable_signals=True)
    publisher = rospy.Publisher("/clock", Clock, queue_size=1)
    began_s = time.monotonic()
    while True:
        publisher.publish(Clock(clock=rospy.Time.from_sec(START_S + time.monotonic() - began_s)))
        time.sleep(0.01)


if __name__ == "__main__":
    main()
