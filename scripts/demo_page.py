"""Writes the demo of the web site: a recorded drive that plays in any browser, from one file and without a server.

``python -m scripts.demo_page site/demo.html`` (``make site``). The virtual hand shows signs in stepped time, and the
drive is recorded. The page has what the report reads from the recording, the pictures, and the landmarks in them.
"""

import argparse
import base64
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2

from handsteer.clock import SteppedClock
from handsteer.config import CameraConfig, Config, VirtualHandConfig
from handsteer.control.explain import Reason
from handsteer.graph import Graph
from handsteer.messages import DIAGNOSTICS, IMAGE_COMPRESSED
from handsteer.nodes.diagnostics import read_status
from handsteer.nodes.status import ControlStatus, RecognitionStatus, RobotStatus
from handsteer.plugins.record.camera import picture_of
from handsteer.plugins.record.files import open_recording
from handsteer.plugins.record.recorded import Recording
from handsteer.plugins.record.replay.drive_facts import DriveFacts
from handsteer.plugins.record.replay.drive_reader import read_drive
from handsteer.plugins.record.replay.report import inert, script_hash
from handsteer.recognition.hand import CONNECTIONS
from handsteer.recognition.recognizer import open_landmarker
from handsteer.types import NONE, SIGNS

FOLDER = Path(__file__).parent / "demo"
SCRIPT = (
    "Stop:2 Forward:1.6 Go:1.8 Turn Left:0.5 Forward:0.5 Go:2.2 Turn Right:0.8 Forward:0.5 Go:3 NONE:1.5 "
    "Stop:1 Backward:2 Go:1.5 Stop:2 Turn Right:1 Go:1 Stop:3"
)
DRIVE_S = 26.0
EVERY = 2
"""Of 30 pictures a second, each second one is shown."""
SIZE = (320, 240)
QUALITY = 70
LARGEST_BYTES = 3_000_000


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", type=Path)
    path = parser.parse_args().page
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / "demo.mcap"
        drive(recording)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(page_of(recording), encoding="utf-8")
    size = path.stat().st_size
    if size > LARGEST_BYTES:
        raise SystemExit(f"{path} has {size / 1e6:.1f} MB, more than {LARGEST_BYTES / 1e6:.0f}")
    print(f"the demo is in {path}: {size / 1e6:.1f} MB")


def drive(path: Path, script: str = SCRIPT, seconds: float = DRIVE_S) -> None:
    """Record a drive by the signs that the virtual hand shows."""
    config = Config(camera=CameraConfig(source="virtual"), virtual_hand=VirtualHandConfig(script=script))
    with Graph(config, SteppedClock()) as graph:
        graph.record(path)
        graph.run_stepped(seconds)


def page_of(path: Path) -> str:
    """Return the page about a recording, as HTML."""
    recording = open_recording(path)
    facts = read_drive(recording)
    script, style = ((FOLDER / f"demo.{kind}").read_text(encoding="utf-8") for kind in ("js", "css"))
    data = json.dumps(data_of(recording, facts), separators=(",", ":"), allow_nan=False)
    policy = (
        f"default-src 'none'; script-src {script_hash(script)}; style-src 'unsafe-inline'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )
    filled = {"policy": policy, "style": style, "data": inert(data), "script": script}
    text = (FOLDER / "demo.html").read_text(encoding="utf-8")
    for name, value in filled.items():
        text = text.replace(f"<!--{name}-->", value)
    return text


def data_of(recording: Recording, facts: DriveFacts) -> dict[str, Any]:
    """Return what the page shows; times are in seconds since the recording began."""
    began_s = recording.began_s
    return {
        "duration": round(facts.duration_s, 2),
        "signs": list(SIGNS),
        "bones": CONNECTIONS,
        "size": SIZE,
        "frames": list(_frames(recording, began_s)),
        "reports": list(_reports(recording, began_s)),
        "path": _rows(facts.truth.table(1000).tolist(), 3),
        "commanded": _rows(facts.commanded.table(1000).tolist(), 3),
        "driven": _rows([row[:3] for row in facts.driven.table(1000).tolist()], 3),
        "spans": [
            [each.sign, round(each.begin_s, 2), round(each.end_s, 2)] for each in facts.spans if each.sign != NONE
        ],
        "stands": [[round(each.time_s, 2), each.reason] for each in facts.stands],
        "things": [
            [each.kind, *_row([each.x, each.y, each.yaw, each.length, each.width], 3), list(each.rgb)]
            for each in facts.things
        ],
    }


def _frames(recording: Recording, began_s: float) -> Iterator[dict[str, Any]]:
    """Yield each second picture, mirrored, and the landmarks in it as x and y in pixels; none without a hand."""
    landmarker = open_landmarker(Config())
    for number, recorded in enumerate(recording.messages({IMAGE_COMPRESSED.name})):
        picture = picture_of(recorded)
        hands = landmarker.detect(picture)
        if number % EVERY:
            continue
        small = cv2.flip(cv2.resize(picture, SIZE, interpolation=cv2.INTER_AREA), 1)
        image = cv2.imencode(".webp", small, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])[1]
        points = ((1 - hands[0].points[:, 0]) * SIZE[0], hands[0].points[:, 1] * SIZE[1]) if hands else ()
        yield {
            "t": round(recorded.time_s - began_s, 3),
            "image": base64.b64encode(image.tobytes()).decode(),
            "hand": [_row(place, 1) for place in zip(*(axis.tolist() for axis in points), strict=True)],
        }


def _reports(recording: Recording, began_s: float) -> Iterator[dict[str, Any]]:
    """Yield what the nodes report, ten times a second: sign, confidences, pose, and what the robot does and why."""
    now: dict[str, Any] = {"sign": NONE, "bars": [], "pose": [0, 0, 0], "does": "", "why": ""}
    for recorded in recording.messages({DIAGNOSTICS.name}):
        for status in map(read_status, recorded.message.status):
            if isinstance(status, RecognitionStatus):
                bars = dict(zip(status.signs, status.confidences, strict=False))
                now |= {"sign": status.sign, "bars": [round(bars.get(sign, 0.0), 2) for sign in SIGNS]}
            elif isinstance(status, RobotStatus) and status.truth is not None:
                now["pose"] = _row([status.truth.x, status.truth.y, status.truth.yaw], 3)
            elif isinstance(status, ControlStatus):
                reason = status.reason or Reason("starting")
                now |= {"does": reason.state(is_moving=bool(status.moving)), "why": status.explanation}
                yield {"t": round(recorded.time_s - began_s, 2), **now}


def _rows(rows: list[list[float]], digits: int) -> list[list[float]]:
    return [_row(row, digits) for row in rows]


def _row(values: Any, digits: int) -> list[float]:
    return [round(float(value), digits) for value in values]


if __name__ == "__main__":
    main()
