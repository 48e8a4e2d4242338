"""Searches the skill of an operator for interfaces of the bench: the constants ``KINDS`` of ``handsteer.bench.laps``.

``JOBS=2 python scripts/bench_skills.py INTERFACE...``. The search is the same for each: 14 random skills, the same
ones, and then 14 variations of the best so far, by the mean score of the laps of four courses, with seeds from 1000 on,
which no report uses. The figure eight is not among the courses.
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from statistics import fmean

import numpy as np

from handsteer.bench.laps import run_lap
from handsteer.bench.operator import Skill

RANGES = {
    "pace_mps": (0.2, 1.0),
    "kp": (0.4, 2.4),
    "kd": (0.0, 1.0),
    "projection_s": (0.6, 2.2),
    "reluctance": (0.1, 2.0),
}
LAPS = (("slalom", 1000), ("slalom", 1001), ("maze", 1000), ("stop-line", 1000), ("parking", 1000))
RANDOM, VARIED, BATCH = 14, 14, 2
SPREAD = 0.12


def score(interface: str, skill: Skill) -> float:
    """Return the mean score in seconds."""
    return fmean(run_lap(course, interface, seed, skill=skill).score_s for course, seed in LAPS)


def search(interface: str, jobs: int) -> tuple[Skill, float]:
    """Return the best skill found, and its mean score."""
    random = np.random.default_rng(0)
    low, high = np.array(list(RANGES.values())).T
    tried: list[tuple[float, list[float]]] = []
    with ProcessPoolExecutor(jobs) as pool:
        for each in range((RANDOM + VARIED) // BATCH):
            if each < RANDOM // BATCH:
                points = low + (high - low) * random.random((BATCH, len(low)))
            else:
                points = np.array(min(tried)[1]) + SPREAD * (high - low) * random.standard_normal((BATCH, len(low)))
            rows = np.clip(points, low, high).round(3).tolist()
            scores = pool.map(partial(score, interface), [Skill(*row) for row in rows])
            tried += zip(scores, rows, strict=True)
    best, row = min(tried)
    return Skill(*row), best


def main(interfaces: list[str]) -> None:
    for interface in interfaces:
        skill, best = search(interface, jobs=int(os.environ.get("JOBS", "1")))
        print(f"{interface}: {asdict(skill)}, mean score {best:.1f} s", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
