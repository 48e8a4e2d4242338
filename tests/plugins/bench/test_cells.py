import numpy as np
import pytest

from handsteer.errors import BenchError
from handsteer.plugins.bench.cells import Cell, Estimate, parse_sweep, run_cells, with_factor
from handsteer.plugins.bench.laps import Conditions

CELL = Cell("stop-line", "pad")


@pytest.mark.slow
def test_results_do_not_depend_on_the_number_of_processes() -> None:
    cells = [CELL, Cell("stop-line", "pad", Conditions(latency_s=0.25))]
    assert run_cells(cells, range(2), jobs=2) == run_cells(cells, range(2))


def test_laps_that_time_out_count() -> None:
    (result,) = run_cells([Cell("slalom", "sliders", Conditions(latency_s=3.0))], [0])
    assert result.timed_out == 1
    assert result.values("time_s") == [180.0]


def test_a_cell_has_statistics() -> None:
    (result,) = run_cells([CELL], range(3))
    found = result.as_dict()
    assert (found["course"], found["interface"], len(found["laps"])) == ("stop-line", "pad", 3)
    assert found["median"]["time_s"]["low"] <= found["median"]["time_s"]["value"] <= found["median"]["time_s"]["high"]
    assert found["median"]["overshoot_m"]["value"] >= 0.0


def test_the_interval_of_a_median_covers_it_as_often_as_it_claims() -> None:
    random = np.random.default_rng(0)
    covers = [
        low.low <= 0.0 <= low.high for low in (Estimate.of(random.standard_normal(20).tolist()) for _ in range(200))
    ]
    assert 0.88 < np.mean(covers) <= 1.0


def test_a_ratio_of_the_same_laps_is_one() -> None:
    assert Estimate.of_ratio([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]) == Estimate(1.0, 1.0, 1.0)


@pytest.mark.parametrize("text", ["latency", "speed=1", "fps=ten", "latency=0,9000", "fps=1"])
def test_a_wrong_sweep_is_refused(text: str) -> None:
    with pytest.raises(BenchError):
        parse_sweep(text)


def test_a_sweep_is_in_the_units_of_the_command_line() -> None:
    assert parse_sweep("latency=0,250") == ("latency", [0.0, 250.0])
    assert with_factor(Conditions(), "latency", 250.0).latency_s == 0.25
