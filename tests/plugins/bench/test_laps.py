import json
import subprocess
import sys

import pytest

from handsteer.errors import BenchError, WorldError
from handsteer.plugins.bench.laps import INTERFACES, Conditions, run_lap


@pytest.mark.slow
@pytest.mark.parametrize("interface", INTERFACES)
def test_the_same_seed_gives_the_same_lap_in_another_process(interface: str) -> None:
    lap = run_lap("stop-line", interface, 7)
    code = (
        "import json; from handsteer.plugins.bench.laps import run_lap;"
        f"print(json.dumps(run_lap('stop-line', {interface!r}, 7).as_dict()))"
    )
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(other.stdout) == lap.as_dict()


def test_seeds_differ() -> None:
    assert run_lap("slalom", "pad", 1) != run_lap("slalom", "pad", 2)


def test_a_practised_operator_finishes_the_slalom_with_the_pad() -> None:
    lap = run_lap("slalom", "pad", 1)
    assert lap.finished
    assert (lap.gates, lap.missed, lap.bumps) == (8, 0, 0)
    assert 0.8 < lap.path_ratio < 1.2
    assert lap.overshoot_m is None


def test_unknown_names_are_refused() -> None:
    with pytest.raises(BenchError, match="no interface 'thoughts'; use signs"):
        run_lap("slalom", "thoughts", 0)
    with pytest.raises(BenchError, match="'empty' is not a course"):
        run_lap("empty", "pad", 0)
    with pytest.raises(WorldError, match="no world 'nowhere'"):
        run_lap("nowhere", "pad", 0)


def test_conditions_out_of_range_are_refused() -> None:
    with pytest.raises(BenchError, match="latency in ms: -1000 should be from 0 to 5000"):
        Conditions(latency_s=-1.0)
