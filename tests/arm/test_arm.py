"""Recognition, control, a graph and a drive on an emulated 64-bit ARM processor, compared with this one's."""

import csv
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera
from handsteer.recognition.landmark_models import find_model
from handsteer.types import SIGNS
from tests.arm.drives import PICTURE_S

ROOT = Path(__file__).parents[2]
PHOTOS = ROOT.parent / "shared" / "data" / "photos"
ARM = ROOT / ".venv" / "arm" / "python"
IN_A_STREAM = 36
CLOSE_PX, MOST_APART_PX = 0.5, 5.0
# The physics and its sines have last bits of their own on each processor; 6e-9 was seen.
AS_MUCH = 1e-6

pytestmark = [
    pytest.mark.arm,
    pytest.mark.skipif(not ARM.exists(), reason="there is no emulated ARM processor: make arm"),
]

Found = dict[str, Any]


def draw(script: str, count: int, folder: Path, name: str) -> None:
    """Write pictures of a virtual hand, 0.1 s apart; a single one is of the moment in which the sign is shown."""
    clock = SteppedClock()
    hand = VirtualHandCamera(VirtualHandConfig(script=script), width=320, height=240, fps=30.0, clock=clock)
    for number in range(count):
        clock.advance(0.6 if count == 1 else PICTURE_S)
        cv2.imwrite(str(folder / f"{name}{number:02}.png"), hand.read().image)


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[Found, Found]:
    """What this processor and the emulated one make of the same pictures and signs.

    Of an emulated processor, a model that computes in floating point asks much: a picture alone takes up to half a
    minute, the next one of a stream some seconds.
    """
    pictures = tmp_path_factory.mktemp("pictures")
    alone, stream = pictures / "alone", pictures / "stream"
    alone.mkdir()
    stream.mkdir()
    people = photos_of_people()
    for sign in SIGNS:
        if sign in people:
            shutil.copy(people[sign], alone / f"{sign}, a person{people[sign].suffix}")
        else:
            draw(f"{sign}:1", 1, alone, sign)
    script = " ".join(f"{sign}:{IN_A_STREAM * PICTURE_S / len(SIGNS)}" for sign in SIGNS)
    draw(script, IN_A_STREAM, stream, "")

    def run(python: Path, *parts: str) -> Found:
        models = find_model("hand_landmark_full.tflite").parent
        command = [str(python), "-m", "tests.arm.drives", str(pictures), *parts]
        env = os.environ | {"HANDSTEER_MODELS": str(models)}
        done = subprocess.run(command, env=env, cwd=ROOT, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[-2000:]
        return dict(json.loads(done.stdout))

    processes = [("recognised",), ("driven", "controlled", "in a graph")]
    with ThreadPoolExecutor() as pool:
        there = list(pool.map(lambda parts: run(ARM, *parts), processes))
        here = run(Path(sys.executable), *sum(processes, ()))
    return here, there[0] | there[1]


def photos_of_people() -> dict[str, Path]:
    """Return a photo of each sign that people show, if there are any here."""
    index = PHOTOS / "index.csv"
    if not index.exists():
        return {}
    with index.open(encoding="utf-8") as lines:
        return {row["sign"]: PHOTOS / row["path"] for row in csv.DictReader(lines) if row["sign"] in SIGNS}


def test_it_is_another_processor(both: tuple[Found, Found]) -> None:
    assert [each["machine"] for each in both] == ["x86_64", "aarch64"]


def test_each_picture_has_the_same_sign_and_landmarks(
    both: tuple[Found, Found], record_property: Callable[[str, object], None]
) -> None:
    here, there = (each["recognised"] for each in both)
    assert [each[:2] for each in here] == [each[:2] for each in there]
    assert {sign for _, sign, _ in here} >= set(SIGNS)
    apart = [np.abs(np.subtract(a[2], b[2])).max() for a, b in zip(here, there, strict=True) if a[2]]
    record_property("landmarks apart, px, median and maximum", (float(np.median(apart)), float(max(apart))))
    assert np.median(apart) < CLOSE_PX
    assert max(apart) < MOST_APART_PX


def test_a_stream_of_pictures_gives_the_same_signs_and_velocities_to_the_bit(both: tuple[Found, Found]) -> None:
    here, there = (each["driven"] for each in both)
    assert here == there
    assert len(here) == IN_A_STREAM
    assert {sign for sign, _ in here} >= set(SIGNS)
    assert len({tuple(velocity) for _, velocity in here}) > 10


def test_a_control_with_random_inputs_commands_the_same_to_the_bit(both: tuple[Found, Found]) -> None:
    here, there = (each["controlled"] for each in both)
    assert here == there
    assert len({tuple(velocity) for velocity in here}) > 500


def test_nodes_in_stepped_time_command_the_same_to_the_bit_and_the_robot_drives_alike(
    both: tuple[Found, Found],
) -> None:
    here, there = (each["in a graph"] for each in both)
    assert here["commands"] == there["commands"]
    drove, drove_there = (
        np.array([[float.fromhex(part) for part in each] for each in one["odometry"]]) for one in (here, there)
    )
    assert np.abs(drove - drove_there).max() < AS_MUCH
    assert np.abs(drove).max() > 0.3
