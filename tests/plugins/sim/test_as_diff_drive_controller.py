"""What users of ROS's diff_drive_controller expect of a robot, asked of ours by its topics alone.

The expectations are those of the tests of ros_controllers (noetic-devel, 678b92a), in words and code of our own.
docs/worlds.md lists those that we do not share.
"""

import math

import pytest

from handsteer.config import RobotConfig
from handsteer.errors import WorldError
from handsteer.messages import CMD_VEL, JOINT_STATES, ODOM, TF, Odometry, twist, yaw_of
from handsteer.nodes.robot import RobotNode
from handsteer.plugins.sim.simulated import SimulatedRobot
from tests.nodes.stepping import Bench

LIMITS = {
    "max_linear": 1.0,
    "max_linear_acceleration": 1.0,
    "max_angular": 2.0,
    "max_angular_acceleration": 2.0,
}
NEAR_M, NEAR_RAD, NEAR_MPS = 0.01, 0.05, 0.02


class Diffbot(Bench):
    """A robot in an empty world, and somebody who commands it 20 times a second."""

    def __init__(self, **settings: object) -> None:
        super().__init__()
        self.config = RobotConfig.model_validate({"world": "empty", **settings})
        self.odometry, self.transforms = self.record(ODOM), self.record(TF)
        self.joints = self.record(JOINT_STATES)
        self.commands = self.transport.advertise("teleop", CMD_VEL)
        self.start()

    def start(self) -> None:
        self.simulated = SimulatedRobot(self.config)
        self.nodes = [RobotNode(self.transport, self.clock, self.simulated, self.config)]
        self.run(0.1)

    def say(self, linear_mps: float, angular_radps: float) -> None:
        self.commands.publish(twist(linear_mps, angular_radps))

    def keep_saying(self, linear_mps: float, angular_radps: float, seconds: float) -> None:
        for _ in range(round(seconds / 0.05)):
            self.say(linear_mps, angular_radps)
            self.run(0.05)

    @property
    def newest(self) -> Odometry:
        return self.odometry[-1]

    @property
    def speed_mps(self) -> float:
        return float(self.newest.twist.twist.linear.x)

    @property
    def turning_radps(self) -> float:
        return float(self.newest.twist.twist.angular.z)

    @property
    def place(self) -> tuple[float, float, float]:
        pose = self.newest.pose.pose
        return pose.position.x, pose.position.y, yaw_of(pose.orientation)

    def is_finite(self) -> bool:
        speeds, pose = self.newest.twist.twist, self.newest.pose.pose
        numbers = (speeds.linear.x, speeds.angular.z, pose.position.x, pose.position.y, pose.orientation.z)
        return all(map(math.isfinite, (*numbers, pose.orientation.w)))


def test_straight_on_it_goes_as_far_as_speed_and_time_say_and_nowhere_else() -> None:
    bot = Diffbot()
    bot.keep_saying(0.1, 0.0, 10.0)
    x, y, yaw = bot.place
    assert x == pytest.approx(1.0, abs=2 * NEAR_M)
    assert (y, yaw) == pytest.approx((0.0, 0.0), abs=NEAR_M)
    flat, upright = bot.newest.pose.pose.position, bot.newest.pose.pose.orientation
    assert (flat.z, upright.x, upright.y) == (0.0, 0.0, 0.0)
    assert bot.speed_mps == pytest.approx(0.1, abs=NEAR_MPS)
    others = bot.newest.twist.twist
    assert (others.linear.y, others.linear.z, others.angular.x, others.angular.y) == (0.0, 0.0, 0.0, 0.0)


def test_in_place_it_turns_as_far_as_speed_and_time_say_and_stays_where_it_is() -> None:
    bot = Diffbot()
    bot.keep_saying(0.0, math.pi / 10, 9.0)
    x, y, yaw = bot.place
    assert yaw == pytest.approx(0.9 * math.pi, rel=0.03)  # it skids, and speeds up first
    assert (x, y) == pytest.approx((0.0, 0.0), abs=NEAR_M)
    assert bot.turning_radps == pytest.approx(math.pi / 10, abs=NEAR_RAD)


def test_odometry_starts_at_zero_and_comes_fifty_times_a_second_also_at_rest() -> None:
    bot = Diffbot()
    bot.odometry.clear()
    bot.run(2.0)
    assert len(bot.odometry) == pytest.approx(100, abs=1)
    assert bot.place == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


def test_odometry_and_transform_say_the_same_in_the_same_frames() -> None:
    bot = Diffbot()
    bot.keep_saying(0.2, 0.5, 1.0)
    odometry, transform = bot.newest, bot.transforms[-1].transforms[0]
    assert transform.header == odometry.header
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "base_link")
    assert transform.child_frame_id == odometry.child_frame_id
    moved = transform.transform.translation
    assert (moved.x, moved.y) == (odometry.pose.pose.position.x, odometry.pose.pose.position.y)
    assert transform.transform.rotation == odometry.pose.pose.orientation


def test_a_frame_of_another_name_takes_the_status_of_the_usual_one() -> None:
    bot = Diffbot(odom_frame_id="new_odom")
    assert {message.header.frame_id for message in bot.odometry} == {"new_odom"}
    assert {each.header.frame_id for message in bot.transforms for each in message.transforms} == {"new_odom"}


def test_the_state_of_each_wheel_is_told() -> None:
    bot = Diffbot()
    bot.keep_saying(0.3, 0.0, 1.0)
    wheels = bot.joints[-1]
    assert len(wheels.name) == len(wheels.position) == len(wheels.velocity) == 4
    assert wheels.velocity.tolist() == pytest.approx([0.3 / bot.config.wheel_radius] * 4, rel=0.05)


def test_linear_acceleration_and_velocity_keep_to_their_limits() -> None:
    bot = Diffbot(**LIMITS)
    bot.keep_saying(10.0, 0.0, 0.5)
    assert 0.3 < bot.speed_mps < 0.5 + NEAR_MPS
    bot.keep_saying(10.0, 0.0, 4.5)
    assert bot.speed_mps == pytest.approx(1.0, abs=NEAR_MPS)
    assert bot.turning_radps == pytest.approx(0.0, abs=NEAR_RAD)


def test_angular_acceleration_and_velocity_keep_to_their_limits() -> None:
    bot = Diffbot(**LIMITS)
    bot.keep_saying(0.0, 10.0, 0.5)
    assert 0.5 < bot.turning_radps < 1.0 + NEAR_RAD
    bot.keep_saying(0.0, 10.0, 4.5)
    assert bot.turning_radps == pytest.approx(2.0, abs=2 * NEAR_RAD)
    assert bot.speed_mps == pytest.approx(0.0, abs=NEAR_MPS)


def test_after_the_timeout_it_brakes_though_the_last_command_was_to_drive() -> None:
    bot = Diffbot(cmd_vel_timeout=0.5, **LIMITS)
    bot.say(1.0, 0.0)
    bot.run(3.0)
    assert bot.place[0] < 0.8
    assert bot.speed_mps == pytest.approx(0.0, abs=NEAR_MPS)
    stood_at = bot.place
    bot.run(1.0)
    assert bot.place == pytest.approx(stood_at, abs=1e-3)


def test_a_command_that_is_said_again_in_time_keeps_it_going() -> None:
    bot = Diffbot(cmd_vel_timeout=0.5, **LIMITS)
    for _ in range(10):
        bot.say(0.5, 0.0)
        bot.run(0.45)
    assert bot.speed_mps == pytest.approx(0.5, abs=NEAR_MPS)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_no_number_moves_nothing(bad: float) -> None:
    bot = Diffbot()
    for wrong in ((bad, 0.0), (0.0, bad)):
        for _ in range(10):
            bot.say(*wrong)
            bot.run(0.1)
            assert bot.is_finite()
    assert bot.place == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    bot.keep_saying(0.1, 0.0, 1.0)
    assert bot.speed_mps == pytest.approx(0.1, abs=NEAR_MPS)


def test_a_command_that_is_no_number_brakes_a_robot_that_drives() -> None:
    bot = Diffbot()
    bot.keep_saying(0.3, 0.0, 1.0)
    bot.say(math.nan, 0.0)
    bot.run(0.35)  # sooner than the timeout would have braked it
    assert bot.speed_mps == pytest.approx(0.0, abs=2 * NEAR_MPS)


def test_a_controller_that_ends_leaves_it_standing_and_a_new_one_says_only_numbers() -> None:
    bot = Diffbot()
    bot.keep_saying(0.1, 0.0, 2.0)
    before = bot.simulated
    bot.nodes[0].stop()
    stood_at = before.step(0.0).truth
    assert before.step(1.0).truth.x == pytest.approx(stood_at.x, abs=1e-3)
    bot.start()
    bot.run(2.0)
    assert bot.is_finite()
    assert bot.speed_mps == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("believed", [0.5, 2.0])
def test_how_far_it_believes_to_have_come_goes_by_the_radius_it_was_told(believed: float) -> None:
    told = RobotConfig().wheel_radius
    bot = Diffbot(wheel_radius=told * believed)
    bot.keep_saying(0.2, 0.0, 3.0)
    truth = bot.simulated.step(0.0).truth
    assert bot.place[0] / truth.x == pytest.approx(believed, rel=0.05)


@pytest.mark.parametrize("wrong", [{"wheel_radius": 0.0}, {"wheel_separation": -1.0}, {"world": "no such world"}])
def test_what_cannot_be_used_never_comes_to_life(wrong: dict[str, object]) -> None:
    with pytest.raises((WorldError, ValueError)):
        Diffbot(**wrong)


def test_of_several_who_command_the_newest_is_followed_within_the_limits() -> None:
    bot = Diffbot(**LIMITS)
    second = bot.transport.advertise("second", CMD_VEL)
    for _ in range(60):
        bot.say(0.0, 0.0)
        bot.run(0.02)
        second.publish(twist(10.0, 0.0))
        bot.run(0.02)
        assert bot.speed_mps <= 1.0 + NEAR_MPS
    bot.run(1.5)  # both have fallen silent
    assert bot.speed_mps == pytest.approx(0.0, abs=NEAR_MPS)
