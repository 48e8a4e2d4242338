"""What becomes of the robot when the driver's network is lost, with a real browser."""

from urllib.parse import urlsplit

import pytest

from tests.plugins.page.network import Relay
from tests.plugins.page.visits import NEEDS_A_BROWSER, visiting

pytestmark = NEEDS_A_BROWSER


def test_a_driver_whose_network_is_lost_leaves_a_robot_that_stands() -> None:
    with visiting("NONE:600", camera={"fps": 5}) as visit:
        page, robot = visit.page, visit.graph.robot
        with Relay(urlsplit(page.url).port or 0) as relay:
            page.goto(f"http://127.0.0.1:{relay.port}/")
            page.locator(".pad").focus()
            page.keyboard.down("ArrowUp")
            visit.wait_until(lambda: robot.state.linear_mps > 0.2)
            relay.freeze()  # the key is still down, and the browser still there
            visit.wait_until(lambda: robot.state.linear_mps == pytest.approx(0, abs=0.01))
