"""Searches the skill of an operator for interfaces of the bench: the constants ``KINDS`` of its module ``laps``.

``JOBS=2 python scripts/bench_skills.py INTERFACE...``. The search is the same for each: a start, 9 random skills, the
same ones, and then 14 variations of the best so far, by the mean score of laps on three courses, with seeds from 1000
on, which no report uses; skills that are clearly worse after some of the laps are given up. Figure eight and parking
are left out.
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from math import inf
from statistics import fmean

import numpy as np

from handsteer.plugins.bench.laps import run_lap
from handsteer.plugins.bench.operator import Skill

RANGES = {
    "pace_mps": (0.2, 1.0),
    "kp": (0.4, 2.4),
    "kd": (0.0, 1.0),
    "projection_s": (0.6, 2.2),
    "reluctance": (0.1, 2.0),
}
LAPS = (("slalom", 1000), ("maze", 1000), ("stop-line", 1000))
START = Skill(1.0, 1.5, 0.5, 1.9, 1.5)
RANDOM, VARIED, BATCH = 10, 14, 2
WORSE = 1.15
SPREAD = 0.12


def scores(interface: str, skill: Skill, best: list[float]) -> list[float]:
    """Return the scores of the laps, in seconds; those after a lap that is clearly worse than ``best`` are infinite."""
    found: list[float] = []
    for course, seed in LAPS:
        found.append(run_lap(course, interface, seed, skill=skill).score_s)
        if best and sum(found) > WORSE * sum(best[: len(found)]):
            return found + [inf] * (len(LAPS) - len(found))
    return found


def search(interface: str, jobs: int) -> tuple[Skill, float]:
    """Return the best skill found, and its mean score."""
    random = np.random.default_rng(0)
    low, high = np.array(list(RANGES.values())).T
    best: list[float] = []
    chosen: list[float] = []
    with ProcessPoolExecutor(jobs) as pool:
        for each in range((RANDOM + VARIED) // BATCH):
            if each < RANDOM // BATCH:
                points = low + (high - low) * random.random((BATCH, len(low)))
            else:
                points = np.array(chosen) + SPREAD * (high - low) * random.standard_normal((BATCH, len(low)))
            if each == 0:
                points[0] = list(asdict(START).values())
            rows = np.clip(points, low, high).round(3).tolist()
            found = pool.map(partial(scores, interface, best=best), [Skill(*row) for row in rows])
            for laps, row in zip(found, rows, strict=True):
                if not best or sum(laps) < sum(best):
                    best, chosen = laps, row
    return Skill(*chosen), fmean(best)


def main(interfaces: list[str]) -> None:
    for interface in interfaces:
        skill, best = search(interface, jobs=int(os.environ.get("JOBS", "1")))
        print(f"{interface}: {asdict(skill)}, mean score {best:.1f} s", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
