"""What a recording costs: runs of a camera with and without one, in turn on the same machine.

The cameras are the virtual hand, whose pictures a recording has to compress, and a recording of it, which delivers JPEG
as browsers do.

Usage: python benchmarks/recording.py [SECONDS] [PAIRS]
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any


def main() -> None:
    """Print CPU time, latency (median and 99th percentile), frames and memory of each run, and the medians."""
    seconds, pairs = (int(word) for word in [*sys.argv[1:], "20", "4"][:2])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        played = folder / "played.mcap"
        _run("virtual", 10, played)
        for camera, source in (("virtual hand", "virtual"), ("camera of JPEG", str(played))):
            print(camera)
            _compare(source, seconds, pairs, folder)


def _compare(source: str, seconds: int, pairs: int, folder: Path) -> None:
    rows: dict[str, list[dict[str, float]]] = {"without": [], "recording": []}
    for _ in range(pairs):
        for name, found in rows.items():
            path = folder / "drive.mcap" if name == "recording" else None
            found.append(_run(source, seconds, path))
            size = path.stat().st_size / seconds if path else 0
            print(f"{name:10s} {_line(found[-1])}{f'  {size / 1e6:.2f} MB/s' if path else ''}", flush=True)
            if path:
                path.unlink()
    medians = {
        name: {key: statistics.median(row[key] for row in found) for key in found[0]} for name, found in rows.items()
    }
    for name, row in medians.items():
        print(f"median {name:10s} {_line(row)}")
    extra = medians["recording"]["core_percent"] - medians["without"]["core_percent"]
    print(f"a recording takes {extra:.1f} % of a core")


def _run(source: str, seconds: int, path: Path | None) -> dict[str, float]:
    command = [sys.executable, "-m", "handsteer", "run", "--headless", "--camera", source, "--json"]
    words = ("--record", str(path)) if path else ()
    process = subprocess.Popen(
        [*command, "--duration", str(seconds), *words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert process.stdout is not None
    summary: dict[str, Any] = json.loads(process.stdout.read())
    _, _, usage = os.wait4(process.pid, 0)
    return {
        "core_percent": 100 * (usage.ru_utime + usage.ru_stime) / seconds,
        "median_ms": summary["latency_median_ms"],
        "p99_ms": summary["latency_p99_ms"],
        "fps": summary["fps"],
        "rss_mb": usage.ru_maxrss / 1024,
    }


def _line(row: dict[str, float]) -> str:
    return (
        f"{row['core_percent']:5.1f} % of a core, latency {row['median_ms']:.1f} and {row['p99_ms']:.1f} ms, "
        f"{row['fps']:.1f} frames/s, {row['rss_mb']:.0f} MB"
    )


if __name__ == "__main__":
    main()
