"""Time over ROS 1 from an image to the resulting Twist, and CPU and memory of each node.

Run ``python benchmarks/ros1.py`` after ``make ros1``. Recognition, control and robot run as processes, with a real
roscore; another process publishes pictures of the virtual hand, stamped when they are sent. A Twist is assigned to its
image by /gesture/image_annotated, which carries the image's stamp and follows its sign; CPU and memory are measured in
a second run, without subscribers of that topic.
"""

import argparse
import itertools
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the graph that the tests use

from _measuring import at_rate, cpu_s, resident_mb
from tests.processes import Peer, eventually
from tests.ros1.graph import Ros1Graph, ros1_graph

from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera

CMD_VEL = "/robot_diff_drive_controller/cmd_vel"
ANNOTATED = "/gesture/image_annotated"
NODES = {"recognition": "/hand_sign_recognition", "control": "/hand_sign_control", "robot": "/robot"}
WIDTH, HEIGHT = 640, 480
WARM_UP_S = 3.0
THEIRS = """The original's nodes, measured in the same way: median 12 to 31 ms, recogniser 290 MB;
at 120 images per second median 374 ms, maximum 1 s."""


def pictures(folder: Path) -> Path:
    """Return a file with one second of the virtual hand, (30, height, width, 3) uint8."""
    clock = SteppedClock()
    camera = VirtualHandCamera(VirtualHandConfig(script="Forward:9"), width=WIDTH, height=HEIGHT, fps=30, clock=clock)
    frames = []
    for _ in range(30):
        clock.advance(1 / 30)
        frames.append(camera.read().image)
    np.save(folder / "frames.npy", np.array(frames))
    return folder / "frames.npy"


def feed(path: str, rate: float) -> None:
    """Publish the pictures of a file in a loop, in its own process."""
    import rospy  # noqa: PLC0415
    from sensor_msgs.msg import Image  # noqa: PLC0415

    rospy.init_node("feeder")
    publisher = rospy.Publisher("/image_raw", Image, queue_size=1, tcp_nodelay=True)
    data = [frame.tobytes() for frame in np.load(path)]
    message = Image(height=HEIGHT, width=WIDTH, encoding="bgr8", step=3 * WIDTH)
    for number in itertools.takewhile(lambda _: not rospy.is_shutdown(), at_rate(rate, sys.maxsize)):
        message.data = data[number % len(data)]
        message.header.stamp = rospy.Time.from_sec(time.time())
        publisher.publish(message)


def latencies_ms(peer: Peer, wall_offset_s: float) -> np.ndarray:
    """Return (n,) milliseconds from an image's stamp to its Twist, which precedes the annotated image."""
    twists = np.array([at_s for at_s, _ in peer.ask("get", topic=CMD_VEL)])
    found = []
    for at_s, (stamp_s,) in peer.ask("get", topic=ANNOTATED):
        before = twists[twists <= at_s]
        if before.size:
            found.append(before[-1] + wall_offset_s - stamp_s)
    return np.array(found) * 1000


def processing_ms(peer: Peer) -> tuple[float, float]:
    """Return the time per frame as reported by the recognition: median and p99."""
    for _, (statuses,) in reversed(peer.ask("get", topic="/diagnostics")):
        for name, values in statuses:
            if name.endswith("hand_sign_recognition") and "processing_ms" in values:
                return float(values["processing_ms"]), float(values["processing_p99_ms"])
    raise SystemExit("hand_sign_recognition has not reported its time per frame")


def measure(graph: Ros1Graph, frames: Path, rate: float, duration_s: float) -> None:
    nodes = {verb: graph.node(verb, name=name) for verb, name in NODES.items()}
    feeder = graph.run(sys.executable, __file__, "--feed", str(frames), "--rate", str(rate))
    eventually(lambda: "/feeder" in graph.nodes())
    time.sleep(WARM_UP_S)
    before = {verb: cpu_s(process.popen.pid) for verb, process in nodes.items()}
    time.sleep(duration_s)
    spent_s = {verb: cpu_s(process.popen.pid) - before[verb] for verb, process in nodes.items()}
    memory_mb = {verb: resident_mb(process.popen.pid) for verb, process in nodes.items()}
    peer = graph.peer()
    peer.ask("record_stamps", topic=ANNOTATED)
    peer.ask("record", topic=CMD_VEL, package="geometry_msgs", type="Twist", fields=["linear.x"])
    peer.ask("record_diagnostics")
    time.sleep(duration_s)
    times = latencies_ms(peer, time.time() - time.monotonic())
    frame_ms, slow_frame_ms = processing_ms(peer)
    p99 = np.percentile(times, 99)
    print(f"{rate:.0f} images a second, {WIDTH}x{HEIGHT}; {len(times)} of them recognised in {duration_s:.0f} s")
    print("                                      median      p99")
    print(f"  one frame's processing            {frame_ms:8.1f} {slow_frame_ms:8.1f} ms")
    print(f"  image to Twist                    {np.median(times):8.1f} {p99:8.1f} ms")
    print(f"  p99 is {p99 / frame_ms:.2f} x a frame's processing (limit 2), {p99 / slow_frame_ms:.2f} x a slow frame's")
    for verb in nodes:
        print(f"  {verb:12s} {100 * spent_s[verb] / duration_s:6.1f} % of a core, {memory_mb[verb]:6.0f} MB")
    for process in (*nodes.values(), feeder, peer):
        process.kill()


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the time from an image to its Twist over ROS 1.")
    parser.add_argument("--duration", type=float, default=15.0, help="seconds per run")
    parser.add_argument("--rate", type=float, help="images per second; by default 30 and 120")
    parser.add_argument("--feed", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.feed:
        feed(options.feed, options.rate)
        return
    for rate in [options.rate] if options.rate else [30.0, 120.0]:
        with tempfile.TemporaryDirectory() as home, ros1_graph(Path(home)) as graph:
            measure(graph, pictures(Path(home)), rate, options.duration)
    print(THEIRS)


if __name__ == "__main__":
    main()
