"""How long the robot drives on when a camera hangs, but its pictures still change a little.

The virtual hand shows Forward to the real models, then the camera fails in each of the ways of the table. Printed is
the time from then to the first zero of :class:`~handsteer.teleop.Teleop`, and what a picture of 640x480 costs
:class:`~handsteer.cameras.freshness.Freshness`.
"""

import argparse
import time
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from handsteer.cameras.files import SensorNoise
from handsteer.cameras.freshness import Freshness
from handsteer.clock import SteppedClock
from handsteer.config import Config, VirtualHandConfig
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.recognition.recognizer import Recognizer
from handsteer.teleop import Teleop

Picture = NDArray[np.uint8]
Fault = Callable[[list[Picture], Picture, int], Picture]

_FPS = 30.0
_LIVE_S = 4.0
_NOISE = SensorNoise(7)
_RANDOM = np.random.default_rng(0)


def _stamped(picture: Picture, index: int) -> Picture:
    stamped = picture.copy()
    cv2.putText(stamped, f"12:00:{index / _FPS:06.3f}", (10, 30), cv2.FONT_HERSHEY_SIMPLEX, 0.8, (255, 255, 255), 2)
    return stamped


def _torn(picture: Picture, live: Picture) -> Picture:
    return np.concatenate([picture[: len(picture) * 4 // 5], live[len(picture) * 4 // 5 :]])


def _one_pixel(picture: Picture, index: int) -> Picture:
    changed = picture.copy()
    changed[200, 320] = index % 251, index // 251, 7
    return changed


def _jpeg(picture: Picture, quality: float) -> Picture:
    return np.asarray(
        cv2.imdecode(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, int(quality)])[1], 1), np.uint8
    )


def _gained(picture: Picture, gain: float) -> Picture:
    return np.asarray(cv2.convertScaleAbs(picture, alpha=gain), np.uint8)


_FAULTS: dict[str, Fault] = {
    "frozen": lambda seen, _live, _index: seen[-1],
    "loop of 9": lambda seen, _live, index: seen[-9:][index % 9],
    "loop of 60": lambda seen, _live, index: seen[-60:][index % 60],
    "torn": lambda seen, live, _index: _torn(seen[-1], live),
    "one pixel changes": lambda seen, _live, index: _one_pixel(seen[-1], index),
    "burnt-in clock": lambda seen, _live, index: _stamped(seen[-1], index),
    "loop of 9 with a burnt-in clock": lambda seen, _live, index: _stamped(seen[-9:][index % 9], index),
    "frozen, with noise": lambda seen, _live, index: _NOISE.on(seen[-1], index / _FPS),
    "frozen, brightness rises": lambda seen, _live, index: _gained(seen[-1], 1.0 + index / 500),
    "frozen, random gain": lambda seen, _live, _index: _gained(seen[-1], _RANDOM.uniform(0.8, 1.2)),
    "frozen, random JPEG quality": lambda seen, _live, _index: _jpeg(seen[-1], _RANDOM.uniform(30, 96)),
}


def stop_s(fault: Fault, recognizer: Recognizer, lasts_s: float) -> float | None:
    """Return the seconds from the failure to the first zero; None if there is none within ``lasts_s``."""
    clock = SteppedClock(100.0)
    camera = VirtualHandCamera(VirtualHandConfig(script="Forward:1"), width=640, height=480, fps=_FPS, clock=clock)
    config = Config.model_validate({"control": {"engage": "off", "arming": "off"}})
    recognizer.reset()
    teleop = Teleop(config, recognizer)
    seen: list[Picture] = []
    for _ in range(round(_LIVE_S * _FPS)):
        clock.advance(1 / _FPS)
        seen.append(camera.read().image)
        velocity = teleop.step(seen[-1], 1 / _FPS)
    assert not velocity.is_zero
    for index in range(round(lasts_s * _FPS)):
        clock.advance(1 / _FPS)
        if teleop.step(fault(seen, camera.read().image, index), 1 / _FPS).is_zero:
            return (index + 1) / _FPS
    return None


def cost_ms() -> float:
    """Return the median time that a picture of 640x480 with a hand takes."""
    freshness = Freshness()
    base, spent = np.full((480, 640, 3), 100, np.uint8), []
    for index in range(2500):
        picture = _NOISE.on(base, index / _FPS)
        begin_s = time.perf_counter()
        freshness.why_refused(picture, 1 / _FPS)
        freshness.why_hand_refused((200, 100, 400, 350), 1 / _FPS)
        spent.append(time.perf_counter() - begin_s)
    return float(np.median(spent)) * 1000


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=25.0, help="how long each fault lasts [s]")
    arguments = parser.parse_args()
    recognizer = Recognizer()
    print(f"A picture costs {cost_ms():.3f} ms.\n\n| the camera | stops after [s] |\n|---|---|")
    for name, fault in _FAULTS.items():
        after_s = stop_s(fault, recognizer, arguments.seconds)
        print(f"| {name} | {'drives on' if after_s is None else f'{after_s:.2f}'} |")


if __name__ == "__main__":
    main()
