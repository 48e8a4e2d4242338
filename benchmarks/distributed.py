"""Effects of a link between two machines: time to stop after a cut, delay of signs, share of images received.

Run ``python benchmarks/distributed.py`` as root, with cyclonedds and iproute2 installed. Camera and robot run in one
network namespace, recognition and control in another, each in its own process over DDS; the link between them delays
and loses packets, and is cut. Both namespaces share one clock.
"""

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the graph that the tests use

from tests.distributed.graph import CMD_VEL, SPEED_MPS, TwoMachines
from tests.distributed.network import NoNamespacesError, two_machines

LIMIT_MS = 500
IMAGES = {"compressed": ("/image_raw/compressed", "CompressedImage", "data"), "raw": ("/image_raw", "Image", "data")}
SETTLE_S = 1.0


@contextmanager
def machines() -> Iterator[TwoMachines]:
    with tempfile.TemporaryDirectory() as home, two_machines(Path(home)) as (robot, workstation, link):
        both = TwoMachines(Path(home), robot, workstation, link)
        try:
            yield both
        finally:
            both.stop()


def percentiles(name: str, values: list[float], unit: str = "ms") -> str:
    low, median, high = (np.percentile(values, percent) for percent in (0, 50, 100))
    ninety = np.percentile(values, 90)
    return f"{name}: {low:.0f} / {median:.0f} / {ninety:.0f} / {high:.0f} {unit} (least, median, 90 %, most)"


def cuts(trials: int) -> None:
    """Cut the link repeatedly while the robot drives."""
    brakes, stands, again = [], [], []
    with machines() as both:
        both.link.shape(0.02, 0.005, 0.01)
        drive = both.start()
        for _ in range(trials):
            drive.until_fast()
            time.sleep(np.random.default_rng().uniform(0.2, 0.5))
            cut_s = both.link.cut()
            drive.until_standing()
            slower_s, stood_s = drive.stop_times(cut_s)
            brakes.append(slower_s * 1000)
            stands.append(stood_s * 1000)
            time.sleep(0.5)
            back_s = both.link.restore()
            drive.until_fast()
            again.append(next(one.at_s - back_s for one in drive.odometry(back_s) if one.speed_mps > 0.005) * 1000)
    print(f"link cut at {SPEED_MPS} m/s, {trials} times ({both.link.kind}, 20 ± 5 ms, 1 % loss)")
    print(percentiles(f"  brakes after (limit {LIMIT_MS})", brakes))
    print(percentiles("  stands after", stands))
    print(percentiles("  moves again after the link is restored", again))


def latencies(seconds: float) -> None:
    """Print the time from a frame's capture to the Twist at the robot."""
    print(
        "from a frame's capture to its Twist at the robot's machine (there and back over the link), 5 frames a second"
    )
    for delay_s in (0.0, 0.02, 0.05):
        with machines() as both:
            both.link.shape(delay_s)
            # So few frames that each Twist belongs to exactly one.
            drive = both.start(camera=("--camera.fps", "5"))
            peer = drive.peer
            peer.ask("record", topic=CMD_VEL, type="Twist", fields=["linear.x"])
            topic, kind, _ = IMAGES["compressed"]
            peer.ask("record", topic=topic, type=kind, fields=["header.stamp"], reliable=False)
            drive.until_moving()
            time.sleep(seconds)
            from_monotonic_s = time.time() - time.monotonic()
            stamps = np.array([stamp for _, (stamp,) in peer.ask("get", topic=topic)])
            twists = np.array([at_s + from_monotonic_s for at_s, _ in peer.ask("get", topic=CMD_VEL)])
        twists = twists[twists > twists[-1] - seconds]
        ages_s = twists - stamps[np.searchsorted(stamps, twists) - 1]
        print(percentiles(f"  {delay_s * 1000:2.0f} ms each way", list(ages_s * 1000)))


def images(count: int) -> None:
    """Print the share of 640x480 images received if one Ethernet frame in a hundred is lost."""
    print(f"640x480 images that arrive of {count}, sent best effort")
    for loss in (0.0, 0.01):
        for name, (topic, kind, data) in IMAGES.items():
            with machines() as both:
                peer = both.onlooker(both.workstation)
                fields = ["header.stamp", data]
                both.link.shape(0.0, 0.0, loss)
                size = ("--camera", "virtual", "--camera.width", "640", "--camera.height", "480")
                camera = both.node(both.robot, "camera", *size, ros=("-p", "virtual_hand.script:=Forward:600"))
                near = both.onlooker(both.robot)
                for one in (near, peer):
                    one.ask("record", topic=topic, type=kind, fields=fields, reliable=False, depth=1)
                while len(near.ask("get", topic=topic)) < 30 or not peer.ask("get", topic=topic):
                    assert camera.running, camera.text
                    time.sleep(SETTLE_S)
                    if loss and name == "raw" and len(near.ask("get", topic=topic)) > count:
                        break
                first = len(near.ask("get", topic=topic))
                while len(sent := near.ask("get", topic=topic)[first:]) < count:
                    time.sleep(SETTLE_S)
                time.sleep(SETTLE_S)
                wanted = {stamp for _, (stamp, _) in sent[:count]}
                came = sum(stamp in wanted for _, (stamp, _) in peer.ask("get", topic=topic))
                size_kb = float(np.median([bytes_ for _, (_, bytes_) in sent])) / 1000
            print(f"  {loss * 100:.0f} % lost, {name:10s} ({size_kb:.0f} kB): {came} of {count}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=20, help="number of cuts of the link")
    parser.add_argument("--seconds", type=float, default=15.0, help="duration of each latency measurement")
    parser.add_argument("--images", type=int, default=300, help="number of images")
    options = parser.parse_args()
    try:
        with machines():
            pass
    except NoNamespacesError as why:
        print(f"cannot create network namespaces: {why}")
        return
    print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores")
    cuts(options.trials)
    latencies(options.seconds)
    images(options.images)


if __name__ == "__main__":
    main()
