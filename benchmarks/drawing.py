"""What a picture of the virtual hand costs, in processor time on one thread.

Run ``python benchmarks/drawing.py``. ``camera`` is all that the virtual camera does for a frame of the default script:
motion, drawing and noise. The other rows are drawing only: each sign and both hands at one distance, turned by up to 20
degrees, in all skins, with and without a sleeve, in a room.
"""

import os
import time
from collections.abc import Callable
from dataclasses import replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cv2
import numpy as np

from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.plugins.virtual_hand.kinematics import pose_skeleton
from handsteer.plugins.virtual_hand.poses import Pinhole, sign_pose
from handsteer.plugins.virtual_hand.renderer import SKINS, Look, make_background, render
from handsteer.types import SIGNS, Handedness

FRAMES, FPS, VIEWS = 480, 30.0, 18
SIZES = ((640, 480), (320, 240), (1280, 720))
DISTANCES_M = (0.25, 0.55, 1.3)
HANDS: tuple[Handedness, ...] = ("Right", "Left")


def main() -> None:
    cv2.setNumThreads(1)
    print(f"{'':28}{'median':>10}{'95 %':>10}")
    for width, height in SIZES:
        report(f"camera, {width}x{height}", camera_times(width, height))
    for distance_m in DISTANCES_M:
        report(f"drawing, {distance_m:g} m, 640x480", drawing_times(distance_m))


def report(name: str, times: list[float]) -> None:
    median, slow = np.percentile(times, [50, 95]) * 1e3
    print(f"{name:28}{median:7.1f} ms{slow:7.1f} ms", flush=True)


def camera_times(width: int, height: int) -> list[float]:
    """Return the seconds of each frame of the default script."""
    clock = SteppedClock()
    camera = VirtualHandCamera(VirtualHandConfig(), width=width, height=height, fps=FPS, clock=clock)
    times = []
    for _ in range(FRAMES):
        clock.advance(1.0 / FPS)
        times.append(seconds(camera.read))
    return times


def drawing_times(distance_m: float) -> list[float]:
    """Return the seconds of drawing hands at that distance."""
    camera, room, random = Pinhole.webcam(640, 480), make_background("cluttered", 640, 480), np.random.default_rng(0)
    times = []
    for sign in SIGNS:
        for hand in HANDS:
            for number in range(VIEWS):
                pose = sign_pose(sign, hand)
                yaw, pitch = np.radians(random.uniform(-20, 20, 2))
                position = (*pose.view.position[:2], distance_m)
                view = replace(pose.view, yaw=pose.view.yaw + yaw, pitch=pose.view.pitch + pitch, position=position)
                look = Look(skin=tuple(SKINS)[number % len(SKINS)], sleeve=number % 2 == 0)
                skeleton, placement = pose_skeleton(pose.angles), view.placement(hand)
                times.append(seconds(lambda: render(skeleton, placement, camera, look, room)))  # noqa: B023
    return times


def seconds(work: Callable[[], object]) -> float:
    """Return the processor time that ``work`` takes."""
    start = time.process_time()
    work()
    return time.process_time() - start


if __name__ == "__main__":
    main()
