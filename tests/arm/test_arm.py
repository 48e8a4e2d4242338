"""Recognition on an emulated 64-bit ARM processor, compared with this one's."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.recognition.landmark_models import find_model

ROOT = Path(__file__).parents[2]
ARM = ROOT / ".venv" / "arm" / "python"
SIGNS = ("Stop", "Forward", "Backward", "Turn Left", "Turn Right", "Go")
CLOSE_PX, MOST_APART_PX = 0.5, 5.0

pytestmark = [
    pytest.mark.arm,
    pytest.mark.skipif(not ARM.exists(), reason="there is no emulated ARM processor: make arm"),
]


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], dict[str, Any]]:
    """What this processor and the emulated one make of the same pictures, one of each sign.

    Of an emulated processor, a model that computes in floating point asks much: a picture takes half a minute.
    """
    pictures = tmp_path_factory.mktemp("pictures")
    for sign in SIGNS:
        clock = SteppedClock()
        config = VirtualHandConfig(script=f"{sign}:1")
        hand = VirtualHandCamera(config, width=320, height=240, fps=30.0, clock=clock)
        clock.advance(0.6)
        cv2.imwrite(str(pictures / f"{sign}.png"), hand.read().image)

    def run(python: Path) -> dict[str, Any]:
        models = find_model("hand_landmark_full.tflite").parent
        command = [python, ROOT / "tests" / "arm" / "recognise.py", pictures]
        env = os.environ | {"HANDSTEER_MODELS": str(models)}
        done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[-2000:]
        return dict(json.loads(done.stdout))

    return run(Path(sys.executable)), run(ARM)


def test_it_is_another_processor(both: tuple[dict[str, Any], dict[str, Any]]) -> None:
    assert [each["machine"] for each in both] == ["x86_64", "aarch64"]


def test_each_picture_has_the_same_sign_and_landmarks(
    both: tuple[dict[str, Any], dict[str, Any]], record_property: Callable[[str, object], None]
) -> None:
    here, there = (each["signs"] for each in both)
    assert [each[:2] for each in here] == [each[:2] for each in there]
    assert {sign for _, sign, _ in here} == set(SIGNS)
    apart = [np.abs(np.subtract(a[2], b[2])).max() for a, b in zip(here, there, strict=True)]
    record_property("landmarks apart, px, median and maximum", (float(np.median(apart)), float(max(apart))))
    assert np.median(apart) < CLOSE_PX
    assert max(apart) < MOST_APART_PX
