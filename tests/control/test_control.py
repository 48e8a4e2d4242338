import math

import pytest

from handsteer.config import ControlConfig
from handsteer.control import Control
from handsteer.types import ZERO, Velocity

DT = 1 / 30


def drives(control: Control) -> Velocity:
    for _ in range(40):
        control.step(DT, sign="Stop")
    velocity = control.step(DT, sign="Forward")
    assert velocity is not None
    return velocity


@pytest.mark.parametrize("dt_s", [-0.1, math.nan, math.inf])
def test_a_time_that_cannot_be_stops_it_until_neutral_was_seen(dt_s: float) -> None:
    control = Control(ControlConfig(), arming=True)
    assert drives(control).linear_mps > 0
    assert control.step(dt_s, sign="Forward") == ZERO
    assert control.step(DT, sign="Forward") == ZERO
    assert drives(control).linear_mps > 0
