"""Checks the simulated operator: laps get worse with delay, and the best ratio of the gains kd / kp rises with it.

``python scripts/bench_operator.py``: the figure eight through the pad, at a constant pace of 0.5 m/s and without any
adaptation to the delay, as in the study of Vozar and Tilbury; the median of the cross-track error, in cm, for each
ratio at its best kp.
"""

import os
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from statistics import median

from handsteer.plugins.bench.laps import Conditions, run_lap
from handsteer.plugins.bench.operator import Skill

DELAYS_S = (0.0, 0.25, 0.5, 0.75)
KP = (0.35, 0.5, 0.7, 1.0, 1.4)
RATIOS_S = (0.0, 0.15, 0.3, 0.45, 0.6, 0.8)
SEEDS = range(2000, 2003)


def error(point: tuple[float, float, float]) -> float:
    """Return the median cross-track error of a delay, kp and ratio, in cm."""
    delay_s, kp, ratio_s = point
    skill = Skill(pace_mps=0.5, kp=kp, kd=kp * ratio_s, projection_s=1.2, reluctance=0.3)
    conditions = Conditions(latency_s=delay_s)
    laps = [run_lap("figure-eight", "pad", seed, conditions, skill=skill, adapts=False) for seed in SEEDS]
    return 100 * median(lap.cross_track_m if lap.finished else 100.0 for lap in laps)


def main() -> None:
    points = list(product(DELAYS_S, KP, RATIOS_S))
    with ProcessPoolExecutor(int(os.environ.get("JOBS", "1"))) as pool:
        errors = dict(zip(points, pool.map(error, points), strict=True))
    print(
        "| added delay | best error | best kp | best kd / kp | "
        + " | ".join(f"{ratio:.2f} s" for ratio in RATIOS_S)
        + " |"
    )
    print("|---" * (4 + len(RATIOS_S)) + "|")
    for delay_s in DELAYS_S:
        best = min((errors[delay_s, kp, ratio], kp, ratio) for kp, ratio in product(KP, RATIOS_S))
        by_ratio = [min(errors[delay_s, kp, ratio] for kp in KP) for ratio in RATIOS_S]
        cells = [f"{1000 * delay_s:.0f} ms", f"{best[0]:.1f} cm", f"{best[1]:g}", f"{best[2]:.2f} s"]
        print("| " + " | ".join([*cells, *(f"{value:.1f}" for value in by_ratio)]) + " |")


if __name__ == "__main__":
    main()
