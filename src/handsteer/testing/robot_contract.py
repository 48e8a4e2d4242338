"""What every robot must do; each robot's own test module inherits it, those of plug-ins too. Needs pytest."""

import math

import pytest

from handsteer.robots import Robot, RobotState

_STEP_S = 0.02
_BRAKES_WITHIN_S = 3.0


class RobotContract:
    """Inherit, and provide ``robot``: one that stands, with free ground around it."""

    @pytest.fixture
    def robot(self) -> Robot:
        raise NotImplementedError

    def test_its_time_goes_on_by_what_is_stepped(self, robot: Robot) -> None:
        began_s = robot.step(0.0).time_s
        assert self.after(robot, 1.0).time_s - began_s == pytest.approx(1.0, abs=_STEP_S)

    def test_it_stands_without_a_command(self, robot: Robot) -> None:
        state = self.after(robot, 0.5)
        assert (state.linear_mps, state.angular_radps) == pytest.approx((0.0, 0.0), abs=0.01)

    def test_it_goes_forward_and_turns_left_as_commanded(self, robot: Robot) -> None:
        state = self.driven(robot, 0.2, 0.3, 2.0)
        assert state.linear_mps == pytest.approx(0.2, abs=0.05)
        assert state.angular_radps == pytest.approx(0.3, abs=0.1)
        assert state.odometry.x > 0.1
        assert state.odometry.yaw > 0.1

    def test_it_brakes_by_itself_when_no_command_comes(self, robot: Robot) -> None:
        self.driven(robot, 0.2, 0.3, 1.0)
        state = self.after(robot, _BRAKES_WITHIN_S)
        assert (state.linear_mps, state.angular_radps) == pytest.approx((0.0, 0.0), abs=0.01)

    @pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
    def test_a_command_that_is_no_number_stops_it(self, robot: Robot, wrong: float) -> None:
        self.driven(robot, 0.2, 0.3, 1.0)
        state = self.driven(robot, wrong, wrong, _BRAKES_WITHIN_S)
        assert (state.linear_mps, state.angular_radps) == pytest.approx((0.0, 0.0), abs=0.01)

    def test_it_tells_what_is_around_it_or_that_it_does_not_know(self, robot: Robot) -> None:
        assert isinstance(robot.obstacles(), list)
        assert isinstance(robot.commanders(), list)
        assert robot.description
        robot.scan()

    def test_it_may_be_closed_twice(self, robot: Robot) -> None:
        robot.close()
        robot.close()

    @staticmethod
    def after(robot: Robot, duration_s: float) -> RobotState:
        """Return the state after steps without a command."""
        for _ in range(round(duration_s / _STEP_S)):
            state = robot.step(_STEP_S)
        return state

    @staticmethod
    def driven(robot: Robot, linear_mps: float, angular_radps: float, duration_s: float) -> RobotState:
        """Return the state after steps with a command each."""
        for _ in range(round(duration_s / _STEP_S)):
            robot.command(linear_mps, angular_radps)
            state = robot.step(_STEP_S)
        return state
