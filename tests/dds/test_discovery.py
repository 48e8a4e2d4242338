"""Who meets whom: our nodes as they are without a word from anybody, and a node that looks at the subnet.

Its configuration of Cyclone DDS is what rmw_cyclonedds_cpp gives where no range is set.
"""

import os
import signal
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import pytest

pytest.importorskip("cyclonedds")

from tests.contracts.node_contract import CMD_VEL
from tests.dds.graph import PEER, ROS_VARIABLES, free_domain
from tests.distributed.network import Machine, NoNamespacesError, two_machines
from tests.processes import Peer, Process, Processes, as_tests_drive, eventually

SUBNET = (
    "<CycloneDDS><Domain><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex></Discovery></Domain></CycloneDDS>"
)
SIGN = "/gesture/hand_sign"
pytestmark = pytest.mark.slow


class Meeting(Processes):
    """A control of ours, with nothing said of the network, and a plain program, each on a machine."""

    def __init__(
        self,
        home: Path,
        domain: int,
        ours: list[str],
        theirs: list[str],
        variables: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        kept = {name: value for name, value in os.environ.items() if name not in ROS_VARIABLES}
        self._env = {**kept, "ROS_DOMAIN_ID": str(domain), "PYTHONUNBUFFERED": "1", **variables}
        self._ours, self._theirs, self._domain = ours, theirs, domain
        super().__init__(home)

    def control(self) -> Process:
        words = [*self._ours, sys.executable, "-m", "handsteer", "control", "--transport", "dds"]
        return self.adopt(Process([*words, *as_tests_drive("control", ())], self._env, self.log()))

    def peer(self, machine: list[str] | None = None) -> Peer:
        words = [*(self._theirs if machine is None else machine), sys.executable, str(PEER), str(self._domain), SUBNET]
        peer = self.adopt(Peer(words, self._env, self.log("peer")))
        peer.ask("record", topic=CMD_VEL, type="Twist", fields=["linear.x"])
        peer.ask("advertise", topic=SIGN, type="String")
        return peer


def drives(peer: Peer) -> bool:
    """Show a sign; return whether the control has answered with a velocity."""
    peer.ask("publish", topic=SIGN, values={"data": "Forward"}, count=5, period_s=0.02)
    return any(speed > 0 for _, (speed,) in peer.ask("get", topic=CMD_VEL))


@pytest.mark.parametrize("first", ["ours", "theirs"])
def test_who_looks_at_the_subnet_is_met_on_one_machine(tmp_path: Path, first: str) -> None:
    meeting = Meeting(tmp_path, free_domain(), [], [])
    try:
        if first == "ours":
            control = meeting.control()
            time.sleep(3.0)  # its first words have gone where nobody listened yet
            peer = meeting.peer()
        else:
            peer = meeting.peer()
            control = meeting.control()
        eventually(lambda: drives(peer), 15.0, what=f"messages to pass both ways: {control.text}")
        control.signal(signal.SIGTERM)
        assert control.code() == 0
    finally:
        meeting.stop()


@pytest.mark.exhaustive
@pytest.mark.parametrize("variables", [{}, {"ROS_STATIC_PEERS": "127.0.0.1"}], ids=["alone", "static peers"])
def test_who_starts_long_after_us_is_met_too(tmp_path: Path, variables: dict[str, str]) -> None:
    """By default, Cyclone DDS drops the addresses at which it has found no other for half a minute."""
    meeting = Meeting(tmp_path, free_domain(), [], [], variables)
    try:
        control = meeting.control()
        eventually(lambda: "is ready" in control.text)
        time.sleep(40.0)
        peer = meeting.peer()
        eventually(lambda: drives(peer), 15.0, what=f"messages to pass both ways: {control.text}")
    finally:
        meeting.stop()


@pytest.mark.netns
def test_another_machine_is_kept_out_and_does_not_keep_us_apart(tmp_path: Path) -> None:
    def met(here: Machine, there: Machine) -> None:
        meeting = Meeting(tmp_path, 3, here.command(), there.command())
        try:
            stranger = meeting.peer()
            meeting.control()
            friend = meeting.peer(here.command())
            eventually(lambda: drives(friend), 20.0, what="who is on our machine to meet us")
            stranger.ask("publish", topic=SIGN, values={"data": "Forward"}, count=50, period_s=0.02)
            assert stranger.ask("listeners", topic=SIGN) == 0
            assert stranger.ask("get", topic=CMD_VEL) == []
        finally:
            meeting.stop()

    on_two_machines(tmp_path, met)


@pytest.mark.netns
def test_on_one_machine_we_go_on_when_the_network_goes(tmp_path: Path) -> None:
    """As a laptop does that leaves its Wi-Fi: our own nodes do not need it."""

    def met(here: Machine, _there: Machine) -> None:
        meeting = Meeting(tmp_path, 4, here.command(), [])
        try:
            robot = here.command(sys.executable, "-m", "handsteer", "robot", "--transport", "dds")
            meeting.adopt(Process(robot, meeting._env, meeting.log()))
            meeting.control()
            peer = meeting.peer(here.command())
            eventually(lambda: drives(peer), 20.0, what="all to meet")
            here.run("ip", "link", "set", "link0", "down")
            here.run("ip", "address", "flush", "dev", "link0")
            since = [*here.command(), sys.executable, "-c", HEARD]
            heard = meeting.adopt(Process(since, meeting._env, meeting.log()))
            assert heard.code(30.0) == 0, heard.text
        finally:
            meeting.stop()

    on_two_machines(tmp_path, met)


HEARD = """
import sys, threading
from handsteer.messages import ODOM, CMD_VEL
from handsteer.transports import join
came = threading.Event()
session = join("dds", "late", [])
session.transport.subscribe("late", ODOM, lambda _: came.set())
sys.exit(not came.wait(20.0))
"""


def on_two_machines(home: Path, what: Callable[[Machine, Machine], None]) -> None:
    try:
        with two_machines(home) as (here, there, _link):
            what(here, there)
    except NoNamespacesError as why:
        pytest.skip(f"network namespaces cannot be made here: {why}")
