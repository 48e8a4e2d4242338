"""Our recognition and control over ROS 1 compared with the course's: CPU time, time to sign and Twist, start-up.

Run ``python benchmarks/ros1_nodes.py`` after ``make ros1``. On one roscore, each chain of recognition and control gets
the same frames of a film of a hand (the virtual hand without films), 30 per second, in alternating rounds. Measured are
the CPU time of each process, over all threads, and the times of sign and Twist of each image. Then each node is started
several times, alternating, with images or signs being published, until its first sign or Twist.

The course's nodes are fetched from their public address, at a fixed commit; without a network, stand-ins of ours with
the same libraries and calls are measured, and the output reports it (``_original_nodes.py``). Theirs have no limits,
watchdog, Stop or arming, all of which ours use. The annotated pictures have no subscribers. Needs Linux.
"""

import argparse
import os
import signal
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the graph that the tests use

from _measuring import at_rate, cpu_s
from _original_nodes import OriginalNodes, original_nodes
from tests.processes import Process
from tests.ros1.graph import Ros1Graph, ros1_graph
from tutorial import CLIPS, VIDEOS, clip_frames

from ros1 import pictures

COURSE, OURS = "course", "ours"
_WARM_UP_S = 1.0
_SETTLE_S = 0.3
_FIRST_S = 60.0
_START_RATE_HZ = 60.0
_CMD_VEL = "/robot_diff_drive_controller/cmd_vel"


@dataclass
class Figures:
    """Measurements of one chain in one round; times in ms."""

    recognition: float
    control: float
    to_sign: list[float]
    to_twist: list[float]


class Chain:
    """Recognition and control of one kind in their own namespace, with this process at both ends.

    Args:
        name: ``course`` or ``ours``.
        graph: The ROS graph.
        nodes: Commands of the course's nodes.
    """

    def __init__(self, name: str, graph: Ros1Graph, nodes: OriginalNodes) -> None:
        import rospy  # noqa: PLC0415 - not everywhere
        from geometry_msgs.msg import Twist  # noqa: PLC0415
        from sensor_msgs.msg import Image  # noqa: PLC0415
        from std_msgs.msg import String  # noqa: PLC0415

        self.name = name
        self._graph, self._nodes = graph, nodes
        self._image = Image(encoding="bgr8")
        self._images = rospy.Publisher(f"/{name}/image_raw", Image, queue_size=1, tcp_nodelay=True)
        # Separate from the recognition's, because a control is started without one.
        self._words = rospy.Publisher(f"/{name}/gesture/hand_sign", String, queue_size=1, tcp_nodelay=True)
        self.sent_s: list[float] = []
        self.signs_s: list[float] = []
        self.twists_s: list[float] = []
        for topic, kind, came in (
            ("gesture/hand_sign", String, self.signs_s),
            (_CMD_VEL[1:], Twist, self.twists_s),
        ):
            rospy.Subscriber(f"/{name}/{topic}", kind, lambda _, came=came: came.append(time.monotonic()))

    def start(self, verb: str) -> Process:
        """Start ``recognition`` or ``control``."""
        environment = ("env", f"ROS_NAMESPACE=/{self.name}", "OPENBLAS_NUM_THREADS=1")
        if self.name == OURS:
            return self._graph.run(*environment, sys.executable, "-m", "handsteer", verb, "--transport", "ros1")
        command = self._nodes.recognition if verb == "recognition" else self._nodes.control
        assert command
        return self._graph.run(*environment, *command, f"{_CMD_VEL}:=/{self.name}{_CMD_VEL}")

    def send(self, image: np.ndarray) -> None:
        """Publish a picture, stamped now."""
        import rospy  # noqa: PLC0415

        height, width, _ = image.shape
        self._image.height, self._image.width, self._image.step = height, width, 3 * width
        self._image.data = image.tobytes()
        self._image.header.stamp = rospy.Time.from_sec(time.time())
        self.sent_s.append(time.monotonic())
        self._images.publish(self._image)

    def say(self, sign: str) -> None:
        """Publish a sign."""
        self._words.publish(sign)


def play(chain: Chain, nodes: dict[str, Process], film: list[np.ndarray], rate_hz: float, seconds: float) -> Figures:
    """Send the film for ``seconds``, after an uncounted second; return the measurements."""
    warm = round(rate_hz * _WARM_UP_S)
    before = {verb: 0.0 for verb in nodes}
    for number in at_rate(rate_hz, warm + round(rate_hz * seconds)):
        if number == warm:
            before = {verb: cpu_s(process.popen.pid) for verb, process in nodes.items()}
            for times in (chain.sent_s, chain.signs_s, chain.twists_s):
                times.clear()
        chain.send(film[number % len(film)])
    time.sleep(_SETTLE_S)
    spent = {verb: 1000 * (cpu_s(process.popen.pid) - before[verb]) for verb, process in nodes.items()}
    signs, sent = len(chain.signs_s), len(chain.sent_s)
    return Figures(
        spent["recognition"] / sent,
        spent["control"] / max(1, signs),
        since_image_ms(chain.sent_s, chain.signs_s),
        since_image_ms(chain.sent_s, chain.twists_s),
    )


def since_image_ms(sent_s: list[float], came_s: list[float]) -> list[float]:
    """Return the age of the newest image at each sign or Twist: its own, unless images queue."""
    newest = np.searchsorted(sent_s, came_s) - 1
    return [1000 * (at_s - sent_s[index]) for at_s, index in zip(came_s, newest, strict=True) if index >= 0]


def measure_rounds(chains: list[Chain], films: dict[str, list[np.ndarray]], options: argparse.Namespace) -> None:
    nodes = {chain.name: {verb: chain.start(verb) for verb in ("recognition", "control")} for chain in chains}
    first = next(iter(films.values()))
    for chain in chains:

        def send(number: int, chain: Chain = chain) -> None:
            chain.send(first[number % len(first)])

        until_first(chain.twists_s, send, options.rate)
    for name, film in films.items():
        figures: dict[str, list[Figures]] = {chain.name: [] for chain in chains}
        for number in range(options.rounds):
            for chain in chains[:: 1 if number % 2 else -1]:
                figures[chain.name].append(play(chain, nodes[chain.name], film, options.rate, options.seconds))
        report_rounds(name, figures)
    for each in nodes.values():
        for process in each.values():
            end(process)


def report_rounds(film: str, figures: dict[str, list[Figures]]) -> None:
    print(f"\n{film}, load {os.getloadavg()[0]:.1f}")
    print(f"{'':34} {'course':>9} {'ours':>9}   ratio of rounds, median (min to max)")
    for title, value in (
        ("recognition, CPU per image", lambda each: each.recognition),
        ("control, CPU per sign", lambda each: each.control),
        ("image to sign, median", lambda each: statistics.median(each.to_sign)),
        ("image to sign, p99", lambda each: float(np.percentile(each.to_sign, 99))),
        ("image to Twist, median", lambda each: statistics.median(each.to_twist)),
        ("image to Twist, p99", lambda each: float(np.percentile(each.to_twist, 99))),
    ):
        report(title, "ms", *([value(each) for each in figures[name]] for name in (COURSE, OURS)))


def report(title: str, unit: str, theirs: list[float], ours: list[float]) -> None:
    ratios = [mine / other for mine, other in zip(ours, theirs, strict=True)]
    print(
        f"{title:34} {statistics.median(theirs):6.2f} {unit:2} {statistics.median(ours):6.2f} {unit:2}   "
        f"{statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
    )


def measure_starts(verb: str, chains: list[Chain], film: list[np.ndarray], starts: int) -> None:
    wall: dict[str, list[float]] = {chain.name: [] for chain in chains}
    processor: dict[str, list[float]] = {chain.name: [] for chain in chains}
    for number in range(starts + 1):
        for chain in chains[:: 1 if number % 2 else -1]:
            wall_s, processor_time_s = start_s(verb, chain, film)
            # The first start compiles Python modules and fills the caches.
            if number:
                wall[chain.name].append(wall_s)
                processor[chain.name].append(processor_time_s)
    what = "sign" if verb == "recognition" else "Twist"
    report(f"{verb} to first {what}, wall", "s", wall[COURSE], wall[OURS])
    report(f"{verb} to first {what}, CPU", "s", processor[COURSE], processor[OURS])


def start_s(verb: str, chain: Chain, film: list[np.ndarray]) -> tuple[float, float]:
    """Return the wall and CPU seconds from the start of a node to its first message."""
    feeds_images = verb == "recognition"
    came = chain.signs_s if feeds_images else chain.twists_s
    came.clear()
    began_s = time.monotonic()
    process = chain.start(verb)

    def feed(number: int) -> None:
        if feeds_images:
            chain.send(film[number % len(film)])
        else:
            chain.say("NONE")

    spent_s = until_first(came, feed, _START_RATE_HZ, process)
    end(process)
    return came[0] - began_s, spent_s


def until_first(
    came: list[float], feed: Callable[[int], None], rate_hz: float, process: Process | None = None
) -> float:
    """Send input until there is output; return the CPU time of ``process`` so far, in seconds."""
    for number in at_rate(rate_hz, round(rate_hz * _FIRST_S)):
        feed(number)
        if came:
            return cpu_s(process.popen.pid) if process else 0.0
    raise SystemExit(f"no message within {_FIRST_S:.0f} s" + (f":\n{process.text}" if process else ""))


def end(process: Process) -> None:
    process.signal(signal.SIGINT)
    process.code()


def load_films(folder: Path, videos: Path, longest: int) -> dict[str, list[np.ndarray]]:
    """Return frames by the name of their film, each forwards and then backwards, so that it can be looped."""
    names = [name for name in list(CLIPS)[:2] if (videos / CLIPS[name]).is_file()]
    films = {name: list(clip_frames(videos / CLIPS[name], longest)) for name in names}
    if not films:
        films = {"the virtual hand": list(np.load(pictures(folder)))}
    return {name: [*frames, *frames[-2:0:-1]] for name, frames in films.items()}


@contextmanager
def joined(graph: Ros1Graph) -> Iterator[None]:
    """This process as a node of the graph."""
    os.environ.update(graph.env)
    import rospy  # noqa: PLC0415 - not everywhere

    rospy.init_node("benchmark", disable_signals=True, argv=["benchmark"])
    yield
    rospy.signal_shutdown("done")


def main() -> None:
    parser = argparse.ArgumentParser(description="Compare our nodes over ROS 1 with the course's.")
    parser.add_argument("--original", type=Path, help="a clone of the course's ros_hand_gesture_recognition")
    parser.add_argument("--videos", type=Path, default=VIDEOS, help="folder with the clips of hands")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=8.0, help="seconds per round")
    parser.add_argument("--rate", type=float, default=30.0, help="images per second")
    parser.add_argument("--starts", type=int, default=7, help="starts of each node")
    parser.add_argument("--only", choices=("rounds", "starts"))
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as home, ros1_graph(Path(home)) as graph, joined(graph):
        nodes = original_nodes(Path(home), options.original)
        print(f"compared with: {nodes.what}")
        for name, value in nodes.parameters.items():
            graph.set_parameter(f"/{COURSE}/hand_sign_recognition/{name}", value)
        chains = [Chain(name, graph, nodes) for name in (COURSE, OURS)]
        films = load_films(Path(home), options.videos, round(options.rate * options.seconds))
        if options.only != "starts" and nodes.recognition:
            measure_rounds(chains, films, options)
        if options.only != "rounds":
            print(f"\n{options.starts} starts each, load {os.getloadavg()[0]:.1f}")
            for verb in ("recognition", "control") if nodes.recognition else ("control",):
                measure_starts(verb, chains, next(iter(films.values())), options.starts)


if __name__ == "__main__":
    main()
