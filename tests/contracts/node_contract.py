"""What our nodes must do as processes, whatever joins them; each transport's own test module inherits it."""

import json
import signal
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest

from tests.processes import Peer, Process, eventually

CMD_VEL = "/robot_diff_drive_controller/cmd_vel"
ODOM = "/robot_diff_drive_controller/odom"
VIRTUAL = ("--camera", "virtual", "--camera.width", "320", "--camera.height", "240", "--camera.fps", "15")
"""A small and slow virtual camera, as several run on one machine; the transport's own words set its script."""
PATIENT = ("--control.sign-timeout", "5")
"""For a control whose signs a busy machine may delay, where that is not the subject."""
LIMIT_S = 0.5
"""From the death of any node to a zero velocity at the robot."""
_SEEN_S = 0.05
"""What it takes until the speed has fallen by so much, or until the peer looks, that it is seen."""

Twists = list[tuple[float, tuple[float, float]]]


def twists(peer: Peer, topic: str = CMD_VEL) -> Twists:
    """Return what was recorded: when, in seconds of the monotonic clock, and (m/s, rad/s)."""
    return [(at_s, (round(x, 6), round(z, 6))) for at_s, (x, z) in peer.ask("get", topic=topic)]


class Driver(ABC):
    """Shows signs to a control of its own namespace, and notes the velocities that come out.

    Attributes:
        process: The control.
    """

    process: Process

    @abstractmethod
    def show(self, sign: str, count: int = 1, period_s: float = 0.02) -> None:
        """Publish ``sign`` so many times."""

    @abstractmethod
    def hold(self, left: float, forward: float, *, held: bool = True) -> None:
        """Publish the state of the hand as a joystick; for a control in that mode."""

    @abstractmethod
    def interfere(self) -> None:
        """Become a second publisher of velocity commands."""

    @property
    @abstractmethod
    def commands(self) -> Twists:
        """What the control has published."""

    @property
    def twists(self) -> list[tuple[float, float]]:
        """What the control has published, without the times."""
        return [twist for _, twist in self.commands]

    def expect(self, *wanted: tuple[float, float]) -> None:
        """Wait for these twists; fail when others come."""
        eventually(lambda: len(self.twists) >= len(wanted), 10.0, what=f"{len(wanted)} twists")
        twists = self.twists
        assert twists[: len(wanted)] == list(wanted), twists


MakeDriver = Callable[..., Driver]
"""Takes options of the command line, and ``parameters``, which it sets in the transport's own way."""


class ControlContract:
    """Inherit, and provide ``drive``."""

    @pytest.fixture
    def drive(self) -> MakeDriver:
        raise NotImplementedError

    def test_exactly_one_twist_a_sign_with_the_values_of_the_course(self, drive: MakeDriver) -> None:
        driver = drive(*PATIENT)
        driver.show("Forward", count=5)
        for sign in ("Turn Left", "Go", "Dance", "Turn Right", "Backward", "Stop", "Forward", "NONE"):
            driver.show(sign)
        grown = [(0.01, 0.0), (0.02, 0.0), (0.03, 0.0), (0.04, 0.0), (0.05, 0.0)]
        kept = [(0.05, 0.1)] * 3 + [(0.05, 0.0), (0.04, 0.0), (0.0, 0.0), (0.01, 0.0), (0.0, 0.0)]
        driver.expect(*grown, *kept)
        time.sleep(0.2)
        assert len(driver.twists) == len(grown) + len(kept)

    def test_signs_that_come_all_at_once_count_each(self, drive: MakeDriver) -> None:
        driver = drive(*PATIENT)
        driver.show("Forward", count=5, period_s=0.0)
        driver.expect(*[(round(0.01 * n, 6), 0.0) for n in range(1, 6)])

    def test_speed_is_bounded_and_does_not_wind_up(self, drive: MakeDriver) -> None:
        driver = drive(*PATIENT, parameters={"max_linear": 0.1, "linear_step": 0.04})
        wanted = [(0.04, 0.0), (0.08, 0.0), *[(0.1, 0.0)] * 58]
        for shown in range(6, 61, 6):  # a node keeps ten that wait
            driver.show("Forward", count=6, period_s=0.01)
            driver.expect(*wanted[:shown])
        driver.show("Backward")
        driver.expect(*wanted, (0.06, 0.0))

    def test_a_joystick_drives_in_its_mode_once_it_was_released(self, drive: MakeDriver) -> None:
        driver = drive("--control.sign-timeout", "2", parameters={"mode": "joystick", "max_linear": 0.5})

        def hold(left: float, forward: float, *, held: bool = True) -> None:
            """Wait for the answer, too: a node keeps the newest state only."""
            seen = len(driver.twists)
            driver.hold(left, forward, held=held)
            eventually(lambda: len(driver.twists) > seen, what="an answer")

        hold(0.0, 0.0, held=False)
        hold(-1.0, 0.5)
        hold(0.0, 0.0, held=False)
        assert driver.twists == [(0.0, 0.0), (0.25, -2.0), (0.0, 0.0)]
        time.sleep(2.3)
        hold(0.0, 1.0)
        hold(0.0, 0.0, held=False)
        hold(0.0, 1.0)
        moves = [twist for twist in driver.twists[3:] if twist != (0.0, 0.0)]
        assert moves == [(0.5, 0.0)], "the first was held since before the pause"

    def test_options_go_before_parameters_before_the_file(self, drive: MakeDriver, tmp_path: Any) -> None:
        file = tmp_path / "my.yaml"
        file.write_text("control: {linear_step: 0.02, angular_step: 0.2, max_linear: 3.0}\n")
        options = (*PATIENT, "--config", str(file), "--control.angular-step=0.4")
        driver = drive(*options, parameters={"linear_step": 0.03, "angular_step": 0.3})
        driver.show("Forward")
        driver.show("Turn Left")
        driver.expect((0.03, 0.0), (0.03, 0.4))

    def test_zero_when_signs_stop_then_silence(self, drive: MakeDriver) -> None:
        driver = drive("--control.sign-timeout", "2")  # longer than a busy machine pauses between two signs
        driver.show("Forward", count=2)
        driver.expect((0.01, 0.0), (0.02, 0.0), (0.0, 0.0))
        time.sleep(0.6)
        assert len(driver.twists) == 3

    @pytest.mark.parametrize("name", ["INT", "TERM", "HUP", "QUIT", "ABRT", "TSTP", "USR1", "ALRM"])
    def test_one_zero_at_exit(self, drive: MakeDriver, name: str) -> None:
        driver = drive(*PATIENT)
        driver.show("Forward", count=2)
        driver.expect((0.01, 0.0), (0.02, 0.0))
        driver.process.signal(signal.Signals[f"SIG{name}"])
        assert driver.process.code() == 0, driver.process.text
        driver.expect((0.01, 0.0), (0.02, 0.0), (0.0, 0.0))

    def test_after_a_freeze_nothing_old_is_obeyed(self, drive: MakeDriver) -> None:
        driver = drive("--control.sign-timeout", "1")
        driver.show("Forward", count=3)
        driver.expect((0.01, 0.0), (0.02, 0.0), (0.03, 0.0))
        driver.process.freeze()
        driver.show("Forward", count=60, period_s=0.033)
        time.sleep(0.4)  # signs of the last 0.35 s are not old, and are obeyed by a machine that takes 0.1 s to go on
        driver.process.signal(signal.SIGCONT)
        driver.expect((0.01, 0.0), (0.02, 0.0), (0.03, 0.0), (0.0, 0.0))
        time.sleep(0.5)
        assert set(driver.twists[3:]) == {(0.0, 0.0)}

    def test_a_hand_that_is_up_at_the_start_moves_nothing_before_neutral_was_seen(self, drive: MakeDriver) -> None:
        driver = drive(*PATIENT, "--control.arming", "auto")
        driver.show("Forward", count=60)
        eventually(lambda: len(driver.twists) >= 60, what="a twist for each sign")
        assert set(driver.twists) == {(0.0, 0.0)}
        driver.show("NONE", count=40)
        driver.show("Forward", count=5)
        eventually(lambda: driver.twists[-1] == (0.05, 0.0), what="the robot to be driven")

    def test_after_a_camera_that_hung_nothing_moves_before_neutral_was_seen(self, drive: MakeDriver) -> None:
        driver = drive("--control.arming", "auto")

        def drives_after(neutral: str, count: int) -> bool:
            """Show neutral and then Forward, between which a busy machine may leave too long a pause."""
            seen = len(driver.twists)
            driver.show(neutral, count=count)
            driver.show("Forward", count=5)
            time.sleep(0.3)  # signs that come late are not answered, so there is nothing to wait for
            return any(speed > 0.0 for speed, _ in driver.twists[seen:])

        eventually(lambda: drives_after("NONE", 40), what="the robot to be driven")
        driver.show("Stop")
        time.sleep(0.6)
        seen = len(driver.twists)
        driver.show("Forward", count=5)
        eventually(lambda: len(driver.twists) > seen, what="an answer")
        time.sleep(0.3)
        assert set(driver.twists[seen:]) == {(0.0, 0.0)}
        eventually(lambda: drives_after("Stop", 1), what="the robot to be driven")

    def test_a_second_publisher_of_commands_is_said(self, drive: MakeDriver) -> None:
        driver = drive(*PATIENT)
        driver.show("Forward")
        driver.expect((0.01, 0.0))
        assert "publishers" not in driver.process.text
        driver.interfere()
        eventually(lambda: "cmd_vel has 2 publishers (" in driver.process.text, 15.0, what="the warning")
        assert "hand_sign_control" in driver.process.text.partition("has 2 publishers (")[2].partition(")")[0]


@dataclass(frozen=True)
class Running:
    """The whole chain as processes.

    Attributes:
        peer: Has recorded ``CMD_VEL`` (linear.x, angular.z) and ``ODOM`` (twist.twist.linear.x, pose.pose.position.x).
        start: Starts each process: robot in a world without obstacles, as it drives on in all tests; control with a
            limit of 0.3 m/s, recognition, camera that shows Forward.
        nodes: Those that were started, by the same names.
    """

    peer: Peer
    start: Mapping[str, Callable[[], Process]]
    nodes: dict[str, Process] = field(default_factory=dict)

    def revive(self) -> "Running":
        """Start what does not run."""
        for name, start in self.start.items():
            if name not in self.nodes or not self.nodes[name].running:
                self.nodes[name] = start()
        return self

    def kill(self, name: str) -> None:
        """Kill a node, and wait until it has gone."""
        self.nodes[name].kill()

    def say_stop(self, stopped: bool) -> None:
        """Publish ``stopped`` on ``/stop``, as anybody may."""
        self.peer.ask("advertise", topic="/stop", package="std_msgs", type="Bool")
        eventually(lambda: self.peer.ask("listeners", topic="/stop") > 0, what="the nodes to listen")
        self.peer.ask("publish", topic="/stop", values={"data": stopped}, count=20, period_s=0.1)

    @property
    def speeds(self) -> list[tuple[float, float]]:
        """When, and the robot's speed in m/s."""
        return [(at_s, speed) for at_s, (speed, _) in self.peer.ask("get", topic=ODOM)]

    @property
    def x_m(self) -> float:
        """Where the robot is."""
        return float(self.peer.ask("get", topic=ODOM)[-1][1][1])

    def expect_full_speed(self) -> "Running":
        """Wait until the robot drives at its limit."""
        eventually(lambda: self.speeds and self.speeds[-1][1] > 0.29, what="the robot to drive at its limit")
        return self

    def expect_rest(self) -> None:
        """Wait until the robot stands."""
        eventually(lambda: abs(self.speeds[-1][1]) < 0.01, 5.0, what="the robot to stand")


class ChainContract:
    """Inherit, and provide ``chain``; the tests go on with it, and start again what they killed."""

    @pytest.fixture(scope="class")
    @classmethod
    def chain(cls) -> Iterator[Running]:
        raise NotImplementedError

    @pytest.fixture
    def running(self, chain: Running) -> Running:
        """The chain while it drives at full speed."""
        return chain.revive().expect_full_speed()

    @pytest.mark.parametrize("victim", ["camera", "recognition", "control"])
    def test_kill_9_of_any_node_stops_the_robot(self, running: Running, victim: str) -> None:
        assert running.x_m > 0.1  # it has moved forward, as the sign says
        killed_s = time.monotonic()
        running.nodes[victim].popen.kill()
        running.expect_rest()
        if victim == "control":
            # No Twist can come any more: the robot's controller brakes by itself.
            stopped_s = next(at_s for at_s, speed in running.speeds if at_s > killed_s and speed < 0.28)
        else:
            zeros = [at_s for at_s, twist in twists(running.peer) if at_s > killed_s and twist == (0.0, 0.0)]
            stopped_s = zeros[0]
            time.sleep(0.3)
            assert {twist for at_s, twist in twists(running.peer) if at_s > stopped_s} <= {(0.0, 0.0)}
        assert stopped_s - killed_s <= LIMIT_S + _SEEN_S

    def test_a_stop_outlives_the_control(self, running: Running) -> None:
        """The hand shows Forward all the time, and the control does not wait for neutral."""
        try:
            running.say_stop(True)
            running.expect_rest()
            running.kill("control")
            running.revive()
            stood_s = time.monotonic()
            eventually(lambda: any(at_s > stood_s for at_s, _ in twists(running.peer)), what="the new control to speak")
            time.sleep(1.5)
            speeds = [speed for at_s, speed in running.speeds if at_s > stood_s]
            assert max(map(abs, speeds)) < 0.05, "it may not have heard so for a moment"
            assert abs(speeds[-1]) < 0.01
        finally:
            running.say_stop(False)
        running.expect_full_speed()
        running.kill("control")
        running.revive().expect_full_speed()

    def test_a_robot_that_was_frozen_does_not_drive_on(self, running: Running) -> None:
        robot = running.nodes["robot"]
        robot.freeze()
        running.nodes["control"].popen.kill()
        time.sleep(1.0)
        resumed_s = time.monotonic()
        robot.signal(signal.SIGCONT)
        running.expect_rest()
        stood_s = next(at_s for at_s, speed in running.speeds if at_s > resumed_s and abs(speed) < 0.01)
        assert stood_s - resumed_s < 0.6  # 0.3 m/s at 1 m/s², and no more


RUN = (
    *("--headless", "--json", *VIRTUAL, "--virtual-hand.script", "Stop:2 Forward:600"),
    *("--control.max-linear", "0.1", "--control.engage-by", "hold"),
)
"""A run that drives a robot of another process, at 0.1 m/s in the end."""


def expect_a_run_to_drive(run: Process, peer: Peer, odom: str) -> None:
    """The robot drives at the run's limit, and stands once the run has ended, which says where it is.

    Args:
        run: Was started by :data:`RUN` and the words of its transport.
        peer: Has recorded ``odom`` (twist.twist.linear.x, pose.pose.position.x).
        odom: The topic of the robot's odometry.
    """

    def newest() -> tuple[float, float]:
        noted = peer.ask("get", topic=odom)
        return tuple(noted[-1][1]) if noted else (0.0, 0.0)

    eventually(lambda: newest()[0] == pytest.approx(0.1, abs=0.01) or not run.running, what="the robot to drive")
    assert run.running, run.text
    run.signal(signal.SIGTERM)
    assert run.code() == 0, run.text
    eventually(lambda: abs(newest()[0]) < 0.01, 5.0, what="the robot to stand")
    summary = json.loads(next(line for line in run.text.splitlines() if line.startswith("{")))
    assert 0.0 < summary["final_pose"]["x"] <= newest()[1] + 0.01
