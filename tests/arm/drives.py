"""Recognises pictures, drives by them, by signs alone and in a graph, and prints as JSON what came out.

It runs on any processor. The Python of ``make arm`` has only what handsteer needs, so nothing else is imported here.
"""

import json
import platform
import random
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from handsteer import Config, Recognizer, Teleop, Velocity
from handsteer.cameras.files import read_photo
from handsteer.config import ControlConfig, RobotConfig
from handsteer.control import Control
from handsteer.messages import CMD_VEL, HAND_SIGN, ODOM, String
from handsteer.nodes.control import HandSignControlNode
from handsteer.nodes.robot import RobotNode
from handsteer.plugins.sim.simulated import SimulatedRobot
from handsteer.robots.world import World
from handsteer.types import NONE, SIGNS, Stick
from tests.nodes.stepping import Bench

LANDMARKS = {"reject_resting": False}  # its model would double the time
PICTURE_S = 0.1
STEPS = 20_000
GRAPH_S = 20.0


def recognised(folder: Path) -> Iterator[tuple[str, str, list[list[float]] | None]]:
    """Yield the name of each picture, its sign, and the (21, 2) landmarks in pixels, if there is a hand."""
    recognizer = Recognizer(Config(landmarks=LANDMARKS))
    for path in sorted(folder.iterdir()):
        seen = recognizer.recognize(path)
        yield path.name, seen.sign, seen.hand.pixels[:, :2].tolist() if seen.hand else None


def driven(folder: Path) -> Iterator[tuple[str, tuple[str, str]]]:
    """Yield the sign, and the velocity, after each picture of a stream."""
    control = ControlConfig(arming="off", engage="off", renew="off")
    teleop = Teleop(Config(landmarks=LANDMARKS, control=control))
    for path in sorted(folder.iterdir()):
        velocity = teleop.step(read_photo(path), PICTURE_S)
        yield teleop.recognition.sign if teleop.recognition else NONE, exact(velocity)


def controlled() -> Iterator[tuple[str, str]]:
    """Yield the velocities of a control that gets signs, sticks, pauses, Stops and resets at random."""
    control, chance = Control(ControlConfig(rule="point"), arming=True), random.Random(0)
    for _ in range(STEPS):
        what, dt_s = chance.random(), chance.choice((0.0, 0.02, 0.033, 0.1, 0.5))
        if what < 0.005:
            velocity: Velocity | None = control.stop()
        elif what < 0.02:
            control.reset()
            velocity = control.step(dt_s)
        elif what < 0.5:
            velocity = control.step(dt_s, sign=chance.choice((*SIGNS, NONE, NONE)))
        elif what < 0.7:
            stick = Stick(chance.random() < 0.8, chance.uniform(-1.0, 1.0), chance.uniform(-1.0, 1.0))
            velocity = control.step(dt_s, sign=NONE, stick=stick)
        elif what < 0.9:
            steering = Velocity(chance.uniform(-1.0, 1.0), chance.uniform(-2.0, 2.0))
            velocity = control.step(dt_s, steering=steering if chance.random() < 0.8 else Velocity(0.0, 0.0))
        else:
            velocity = control.step(dt_s)
        if velocity is not None:
            yield exact(velocity)


def in_a_graph() -> dict[str, list[tuple[str, str]]]:
    """Return the commands, and the velocities of the simulated robot, of control and robot as nodes in stepped time."""
    bench = Bench()
    commands, odometry = bench.record(CMD_VEL), bench.record(ODOM)
    robot = SimulatedRobot(RobotConfig(), World())
    bench.nodes += [
        HandSignControlNode(bench.transport, bench.clock, ControlConfig()),
        RobotNode(bench.transport, bench.clock, robot, RobotConfig()),
    ]
    say, chance, sign = bench.transport.advertise("onlooker", HAND_SIGN), random.Random(1), NONE
    for number in range(round(GRAPH_S * 30)):
        if number % 15 == 0:
            sign = chance.choice((*SIGNS, NONE))
        say.publish(String(data=sign))
        bench.run(1 / 30)
    twists = {"commands": commands, "odometry": [each.twist.twist for each in odometry]}
    return {name: [exact(Velocity(one.linear.x, one.angular.z)) for one in each] for name, each in twists.items()}


def exact(velocity: Velocity) -> tuple[str, str]:
    """Return both parts of a velocity to the last bit."""
    return velocity.linear_mps.hex(), velocity.angular_radps.hex()


PARTS: dict[str, Callable[[Path], object]] = {
    "recognised": lambda folder: list(recognised(folder / "alone")),
    "driven": lambda folder: list(driven(folder / "stream")),
    "controlled": lambda _: list(controlled()),
    "in a graph": lambda _: in_a_graph(),
}

if __name__ == "__main__":
    found = {part: PARTS[part](Path(sys.argv[1])) for part in sys.argv[2:]}
    json.dump({"machine": platform.machine(), **found}, sys.stdout)
