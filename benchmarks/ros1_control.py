"""What our control costs over ROS 1 beside the course's own, which has no limits, watchdog, Stop or arming.

Run ``python benchmarks/ros1_control.py`` after ``make ros1``. Both run at once as processes on one roscore, hear the
same 30 signs a second, and publish to a listener each. Counted is the processor time of each process; the course's
control is taken out of its chapter where that is beside the repository, else it is one of ours with the same calls.
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the graph and the course's node that the tests use

from tests.processes import Process, eventually
from tests.ros1.course import make_package
from tests.ros1.graph import ros1_graph

RATE_HZ = 30
SETTLE_S = 5.0
CMD_VEL = "/robot_diff_drive_controller/cmd_vel"
OURS = "/ours/cmd_vel"
_TALKER = f"""
import rospy
from std_msgs.msg import String
rospy.init_node("talker")
publisher, rate, count = rospy.Publisher("/gesture/hand_sign", String, queue_size=1), rospy.Rate({RATE_HZ}), 0
while not rospy.is_shutdown():
    publisher.publish(("Forward", "Turn Left", "Stop", "NONE")[count // {RATE_HZ} % 4])
    count += 1
    rate.sleep()
"""
_LISTENER = """
import sys, rospy
from geometry_msgs.msg import Twist
rospy.init_node("listener", anonymous=True)
rospy.Subscriber(sys.argv[1], Twist, lambda _: None)
rospy.spin()
"""


def processor_s(process: Process) -> float:
    """Return the processor time of a process so far, in seconds."""
    fields = Path(f"/proc/{process.popen.pid}/stat").read_text().rpartition(") ")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    parser = argparse.ArgumentParser(description="Compare our control over ROS 1 with the course's.")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=10.0, help="of each round")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, ros1_graph(Path(folder)) as graph:
        graph.set_parameter("/hand_sign_recognition/publish_gesture_topic", value="/gesture/hand_sign")
        package = make_package(Path(folder))
        for topic in (CMD_VEL, OURS):
            graph.run(sys.executable, "-c", _LISTENER, topic)
        graph.run(sys.executable, "-c", _TALKER)
        course = graph.run(str(package / "sign_to_controller.py"))
        ours = graph.handsteer("control", "--transport", "ros1", "--control.arming", "off", f"{CMD_VEL[1:]}:={OURS}")
        eventually(lambda: "/hand_sign_control" in graph.nodes(), what="our control")
        time.sleep(SETTLE_S)
        print("processor time, ms a second   the course's   ours   ratio   load")
        for _ in range(options.rounds):
            before = processor_s(course), processor_s(ours)
            time.sleep(options.seconds)
            theirs, mine = (
                1000 * (processor_s(process) - spent) / options.seconds
                for process, spent in zip((course, ours), before, strict=True)
            )
            print(f"{'':29} {theirs:12.1f} {mine:6.1f} {mine / theirs:7.2f} {os.getloadavg()[0]:6.1f}")


if __name__ == "__main__":
    main()
