"""Plays the images of a bag as ``ros2 bag play`` does, of which there are no wheels; on the Python of ``make ros2``.

What matters of rosbag2's player: a node of its name, reliable publishers that send what was recorded, as it was
encoded, with its old stamps, at its pace; it waits for a subscriber first (there: ``--delay``), and at the end until
all has arrived (``--wait-for-all-acked``).

Arguments: the bag's folder, how many times as fast.
"""

import sys
import time
from importlib import import_module
from pathlib import Path

import rclpy
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from rosbags.rosbag2 import Reader

folder, rate = Path(sys.argv[1]), float(sys.argv[2])
rclpy.init()
node = rclpy.create_node("rosbag2_player")
with Reader(folder) as reader:
    publishers = {}
    for connection in reader.connections:
        package, _, name = connection.msgtype.split("/")
        kind = getattr(import_module(f"{package}.msg"), name)
        publishers[connection.id] = node.create_publisher(kind, connection.topic, QoSProfile(depth=10))
    while not all(publisher.get_subscription_count() for publisher in publishers.values()):
        rclpy.spin_once(node, timeout_sec=0.01)
    time.sleep(2.0)  # rosbag2's --delay
    began_s = time.monotonic()
    for connection, stamp_ns, raw in reader.messages():
        due_s = began_s + (stamp_ns - reader.start_time) / 1e9 / rate
        time.sleep(max(0.0, due_s - time.monotonic()))
        publishers[connection.id].publish(bytes(raw))
    for publisher in publishers.values():
        publisher.wait_for_all_acked(Duration(seconds=30))
node.destroy_node()
rclpy.shutdown()
