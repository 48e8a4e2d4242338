"""What viewers do, on /audit."""

from concurrent.futures import Future
from functools import partial
from pathlib import Path

from handsteer.audit import AuditEvent, read_event
from handsteer.clock import SteppedClock
from handsteer.config import Config
from handsteer.graph import Graph
from handsteer.messages import AUDIT, Log
from handsteer.nodes.steering import SteeringNode
from handsteer.plugins.page.editing import add
from handsteer.plugins.page.node import DashboardNode
from handsteer.plugins.page.settings import Settings, SettingsFile
from handsteer.plugins.page.settings_fields import FIELDS
from handsteer.plugins.page.viewers import ANSWER_S, ControlLease, PageAudit
from handsteer.testing.transport_contract import eventually
from handsteer.transports.base import Received
from handsteer.transports.in_process import InProcessTransport
from handsteer.types import Pose2D
from tests.plugins.page.served import remote


class Bench:
    def __init__(self) -> None:
        self.clock = SteppedClock()
        self.transport = InProcessTransport()
        self.told: list[AuditEvent] = []
        self.transport.subscribe("listener", AUDIT, self._take)
        self.audit = PageAudit(self.transport, self.clock)
        self.audit.introduce("page a", "session a", "192.0.2.7")
        self.audit.introduce("page b", "session b", "192.0.2.9")

    def _take(self, received: Received[Log]) -> None:
        event = read_event(received.message)
        assert event is not None
        self.told.append(event)

    def take(self) -> list[tuple[str, str, str]]:
        """Return the code, who and the sentence of what was told since the last call."""
        told, self.told = self.told, []
        return [(event.code, event.who.partition(" (")[0], event.sentence) for event in told]


def test_viewers_have_numbers_by_session_and_addresses() -> None:
    audit = Bench().audit
    audit.introduce("page c", "session a", "192.0.2.7")
    assert [audit.name_of(page) for page in ("page a", "page b", "page c")] == [
        "viewer 1 (192.0.2.7)",
        "viewer 2 (192.0.2.9)",
        "viewer 1 (192.0.2.7)",
    ]
    audit.forget("page a")
    assert audit.name_of("page a") == "a viewer"


def test_each_change_of_the_seat_is_told() -> None:
    bench = Bench()
    lease = ControlLease(bench.audit.on_seat)
    lease.take("page a", 0.0)
    lease.take("page a", 0.1)
    assert bench.take() == [("seat_taken", "viewer 1", "took the seat, which was free")]
    lease.ask("page b", 1.0)
    lease.answer("page a", hand_over=True)
    assert [(code, who) for code, who, _ in bench.take()] == [("seat_left", "viewer 1"), ("seat_taken", "viewer 2")]
    bench.clock.advance_to(2.0)
    lease.ask("page a", 2.0)
    lease.tick(2.0 + ANSWER_S)
    assert [(code, who) for code, who, _ in bench.take()] == [("seat_lost", "viewer 2"), ("seat_taken", "viewer 1")]
    bench.clock.advance_to(3.0)
    lease.leave("page a")
    assert [(code, who) for code, who, _ in bench.take()] == [("seat_left", "viewer 1")]


def test_stop_reset_and_steering_are_told_with_who_did_it() -> None:
    bench = Bench()
    wires = (bench.transport, bench.clock)
    node = DashboardNode(*wires, SteeringNode(*wires), audit=bench.audit)
    node.steer("page a", 0.1, 0.0)
    node.steer("page a", 0.2, 0.0)
    node.halt("page b")
    node.reset("page b")
    node.reset("page a")
    assert [(code, who) for code, who, _ in bench.take()] == [
        ("seat_taken", "viewer 1"),
        ("steers", "viewer 1"),
        ("stop_pressed", "viewer 2"),
        ("reset_pressed", "viewer 1"),
    ]


def test_changes_of_the_graph_are_told_as_the_drivers(tmp_path: Path) -> None:
    with Graph(Config(), steering=False) as graph, remote(graph) as page:
        told: list[Log] = []
        graph.transport.subscribe("listener", AUDIT, lambda received: told.append(received.message))
        page.audit.introduce("page a", "session a", "192.0.2.7")
        ControlLease(page.audit.on_seat).take("page a", 0.0)
        graph.start()
        file = SettingsFile(tmp_path / "handsteer.yaml", is_read=False)
        save = lambda done: page.audit.say_of_driver("settings_saved", done, "handsteer.yaml")  # noqa: E731
        settings = Settings(lambda: page.config, page.reconfigure, file, save)
        settings.set(FIELDS["control.max_linear"], "0.3")
        settings.save()
        changed: Future[None] = page.change_world(partial(add, shape="box", robot=Pose2D(0.0, 0.0, 0.0)))
        changed.result(10)
        page.choose_camera("own")
        wanted = {"seat_taken", "setting_changed", "settings_saved", "world_changed", "camera_chosen"}
        assert eventually(lambda: wanted <= {each.function for each in told})
        assert {each.name for each in told if each.function in wanted} == {"viewer 1 (192.0.2.7)"}
        (setting,) = [each.msg for each in told if each.function == "setting_changed"]
        assert setting == "changed control.max_linear from 1 to 0.3"
