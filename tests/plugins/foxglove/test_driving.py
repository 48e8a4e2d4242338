"""Programs that drive the robot, by real clients."""

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Page
from websockets.exceptions import InvalidStatus

from handsteer.clock import RealClock
from handsteer.config import FoxgloveConfig, load
from handsteer.graph import Graph
from handsteer.messages import AUDIT, STEERING_CMD_VEL, Twist, Vector3, twist
from handsteer.nodes.steering import SteeringNode
from handsteer.plugins.foxglove.driving import CONFIRM_S, Driving, Seat, SharedSeat
from handsteer.plugins.foxglove.process import LiveProcess
from handsteer.plugins.foxglove.server import LiveServer
from handsteer.plugins.page.page_process import PageProcess
from handsteer.timeouts import HOLD_TIMEOUT_S
from handsteer.transports.encoding import encode
from handsteer.transports.in_process import InProcessTransport
from handsteer.types import ZERO, Velocity
from tests.nodes.stepping import Bench
from tests.plugins.foxglove.viewer import Viewer
from tests.plugins.page.browsers import a_browser
from tests.plugins.page.network import Relay
from tests.plugins.page.visits import NEEDS_A_BROWSER
from tests.processes import eventually

AHEAD = Velocity(0.3, 0.1)


class Wheel:
    """The driving on a stepped clock, and what is heard of it."""

    def __init__(self) -> None:
        self.bench = Bench()
        node = SteeringNode(self.bench.transport, self.bench.clock)
        self.bench.nodes = [node]
        self.seat = Seat()
        self.driving = Driving(node, self.seat)
        self.heard = self.bench.record(STEERING_CMD_VEL)

    def tap(self, program: str = "A") -> None:
        """Press once and release."""
        self.driving.command(program, AHEAD)
        self.release(program)

    def release(self, program: str = "A") -> None:
        """Command nothing for a while, although the program is connected."""
        self.bench.run(HOLD_TIMEOUT_S + 0.1)
        self.driving.note_silence(program)

    def repeat(self, seconds: float, program: str = "A", wanted: Velocity = AHEAD) -> None:
        for _ in range(round(seconds / 0.05)):
            self.driving.command(program, wanted)
            self.bench.run(0.05)

    def newest(self) -> tuple[float, float]:
        return self.heard[-1].linear.x, self.heard[-1].angular.z


@pytest.fixture
def wheel() -> Wheel:
    wheel = Wheel()
    wheel.tap()
    return wheel


def test_what_a_program_holds_when_it_starts_moves_nothing_before_it_was_released() -> None:
    wheel = Wheel()
    wheel.repeat(5.0)
    assert not wheel.heard
    wheel.release()
    wheel.repeat(0.5)
    assert wheel.newest() == (0.3, 0.1)


def test_a_zero_of_a_program_is_a_release() -> None:
    wheel = Wheel()
    wheel.repeat(0.1, wanted=ZERO)
    wheel.repeat(0.3)
    assert wheel.newest() == (0.3, 0.1)


def test_a_late_zero_of_a_program_is_no_release() -> None:
    wheel = Wheel()
    wheel.driving.command("A", ZERO, is_late=True)
    wheel.repeat(1.0)
    assert all(newest == twist(0.0, 0.0) for newest in wheel.heard)


def test_commands_count_after_a_moment_and_end_with_the_last(wheel: Wheel) -> None:
    wheel.repeat(CONFIRM_S - 0.01)
    assert set(map(str, wheel.heard)) == {str(twist(0.0, 0.0))}
    wheel.repeat(0.3)
    assert wheel.newest() == (0.3, 0.1)
    wheel.bench.run(HOLD_TIMEOUT_S + 0.1)
    assert wheel.newest() == (0.0, 0.0)
    count = len(wheel.heard)
    wheel.bench.run(1.0)
    assert len(wheel.heard) == count  # others can drive


def test_a_zero_stops_at_once(wheel: Wheel) -> None:
    wheel.repeat(0.5)
    wheel.driving.command("A", ZERO)
    assert wheel.newest() == (0.0, 0.0)


def test_commands_that_a_network_held_back_stop_the_robot(wheel: Wheel) -> None:
    wheel.repeat(0.5)
    for _ in range(100):
        wheel.driving.command("A", AHEAD, is_late=True)
        assert wheel.newest() == (0.0, 0.0)
        wheel.bench.run(0.01)
    wheel.repeat(2.0)
    assert wheel.newest() == (0.0, 0.0)
    wheel.release()
    wheel.repeat(CONFIRM_S + 0.1)
    assert wheel.newest() == (0.3, 0.1)


@pytest.mark.parametrize("silent_s", [0.35, 0.6, 2.0])
def test_a_silence_of_the_network_is_no_release(wheel: Wheel, silent_s: float) -> None:
    wheel.repeat(0.5)
    wheel.bench.run(silent_s)
    assert wheel.newest() == (0.0, 0.0)
    wheel.repeat(2.0)
    assert wheel.newest() == (0.0, 0.0)
    wheel.driving.note_silence("A")  # it commands again: that it was silent before does not count any more
    wheel.repeat(0.5)
    assert wheel.newest() == (0.0, 0.0)
    wheel.release("another")
    wheel.repeat(0.5)
    assert wheel.newest() == (0.0, 0.0)
    wheel.release()
    wheel.repeat(0.5)
    assert wheel.newest() == (0.3, 0.1)


def test_one_program_drives_until_it_leaves(wheel: Wheel) -> None:
    wheel.repeat(0.5, "A")
    assert not wheel.driving.command("B", Velocity(-0.3, 0.0))
    wheel.driving.leave("B")
    wheel.repeat(0.1, "A")
    assert wheel.newest() == (0.3, 0.1)
    wheel.driving.leave("A")
    assert wheel.newest() == (0.0, 0.0)
    wheel.bench.run(1.0)
    assert wheel.driving.command("B", ZERO)


def test_who_loses_the_seat_stops(wheel: Wheel) -> None:
    wheel.repeat(0.5, "A")
    wheel.seat.leave("A")
    wheel.seat.ask("a viewer")
    wheel.bench.run(0.1)
    assert wheel.newest() == (0.0, 0.0)
    wheel.repeat(0.5, "A")
    assert wheel.newest() == (0.0, 0.0)


def test_the_seat_of_the_page_is_asked_for_once_a_second() -> None:
    bench, said = Bench(), list[tuple[str, str]]()
    node = SteeringNode(bench.transport, bench.clock)
    bench.nodes = [node]
    seat = SharedSeat(lambda request, program: said.append((request, program)))
    driving = Driving(node, seat)
    for _ in range(25):
        assert not driving.command("A", AHEAD)
        bench.run(0.1)
    assert said == [("ask", "A")] * 3
    seat.note("A")
    assert driving.command("A", AHEAD)
    seat.note("a viewer")
    assert not driving.command("A", AHEAD)
    driving.leave("A")
    assert said[-1] == ("leave", "A")


@contextmanager
def served(graph: Graph, seat: Seat | None = None) -> Iterator[str]:
    node = SteeringNode(graph.transport, graph.clock, name="foxglove")
    driving = Driving(node, seat or Seat())
    server = LiveServer(graph.transport, graph.clock, graph.topics, FoxgloveConfig(port=0), driving)
    node.start()
    try:
        yield server.start()
    finally:
        server.stop()
        node.stop()


@contextmanager
def standing(*, steering: bool = True) -> Iterator[Graph]:
    """Yield a running graph whose camera sees no hand."""
    camera = {"source": "virtual", "width": 320, "height": 240, "fps": 15}
    config = load(base={"camera": camera, "virtual_hand": {"script": "NONE:600"}, "dashboard": {"port": 0}})
    with Graph(config, steering=steering) as graph:
        graph.start()
        yield graph


@contextmanager
def repeated(command: Callable[[], None]) -> Iterator[None]:
    """Call ``command`` twenty times a second meanwhile."""
    ended = threading.Event()

    def repeat() -> None:
        while not ended.wait(0.05):
            command()

    thread = threading.Thread(target=repeat)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def tap(command: Callable[[], None]) -> None:
    """Press once and release: what a program commands first may have been held since long."""
    command()
    time.sleep(2 * HOLD_TIMEOUT_S)


def speed(graph: Graph) -> float:
    return graph.robot.state.linear_mps


def press_until_it_drives(graph: Graph, command: Callable[[], None]) -> None:
    """Press, release and press again, as a person does where a busy machine has held up what the program sent."""
    tap(command)
    for _ in range(10):
        with repeated(command):
            end_s = time.monotonic() + 3.0
            while time.monotonic() < end_s:
                if abs(speed(graph)) > 0.1:
                    return
                time.sleep(0.05)
        time.sleep(2 * HOLD_TIMEOUT_S)
    pytest.fail("pressed again and again in vain")


def stands(graph: Graph) -> bool:
    return abs(speed(graph)) < 0.005


ORIGINS = (None, "http://localhost:5000", "file://", "chrome-extension://abcdef", "https://app.foxglove.dev", "null")


@pytest.mark.slow
@pytest.mark.parametrize("origin", ORIGINS)
def test_who_may_drive_has_the_token(origin: str | None) -> None:
    headers = [] if origin is None else [("Origin", origin)]
    with standing() as graph, served(graph) as address:
        bare, _, token = address.partition("/?token=")
        assert token
        for stranger in (bare, f"{bare}/?token=", f"{bare}/?token={token[:-1]}"):
            with pytest.raises(InvalidStatus, match="401"):
                Viewer(stranger, headers=headers)
        with Viewer(address, headers=headers) as viewer:
            viewer.advertise()
            press_until_it_drives(graph, lambda: viewer.command(0.2))


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["json", "cdr"])
def test_a_program_drives_and_when_it_is_silent_or_gone_the_robot_stops(encoding: str) -> None:
    wanted = Twist(Vector3(0.2, 0.0, 0.0), Vector3(0.0, 0.0, 0.0))
    content = encode(wanted) if encoding == "cdr" else b'{"linear": {"x": 0.2}, "angular": {}}'
    seat = Seat()
    with standing() as graph, served(graph, seat) as address, Viewer(address) as other:
        with Viewer(address) as viewer:
            assert viewer.info["capabilities"] == ["clientPublish"]
            assert encoding in viewer.info["supportedEncodings"]
            viewer.advertise(encoding)
            press_until_it_drives(graph, lambda: viewer.publish(content))
            eventually(lambda: stands(graph), what="the end of a silent program's commands")
            other.advertise()
            other.command(0.2)
            assert "another one drives the robot" in other.said()["message"]
            press_until_it_drives(graph, lambda: viewer.publish(content))
        eventually(lambda: stands(graph))
        eventually(lambda: seat.driver is None)

        def has_the_seat() -> bool:
            other.command(-0.2)  # it has asked a moment ago, so this may be too early to ask again
            return seat.driver is not None

        eventually(has_the_seat)
        press_until_it_drives(graph, lambda: other.command(-0.2))  # the second program, once the first has gone


@pytest.mark.slow
def test_what_a_network_held_back_moves_nothing() -> None:
    with standing() as graph, served(graph) as address, Viewer(address) as viewer:
        viewer.advertise()
        press_until_it_drives(graph, lambda: viewer.command(0.2))
        eventually(lambda: stands(graph))
        before_m = graph.robot.path_length_m
        for _ in range(600):
            viewer.command(0.2)
        viewer.publish(b"the last")
        assert "expected geometry_msgs/Twist" in viewer.said()["message"]
        time.sleep(HOLD_TIMEOUT_S)
        assert graph.robot.path_length_m - before_m < 0.02


@pytest.mark.slow
def test_a_short_stall_of_a_network_is_no_release() -> None:
    """The program holds its button all the time; what it sends meanwhile comes late, and all at once."""
    with ExitStack() as opened:
        graph = opened.enter_context(standing())
        address = urlsplit(opened.enter_context(served(graph)))
        relay = opened.enter_context(Relay(address.port or 0))
        viewer = opened.enter_context(Viewer(address._replace(netloc=f"127.0.0.1:{relay.port}").geturl()))
        viewer.advertise()
        press_until_it_drives(graph, lambda: viewer.command(0.2))
        relay.freeze()
        eventually(lambda: stands(graph))
        for _ in range(3):
            viewer.command(0.2)
        time.sleep(2 * HOLD_TIMEOUT_S)
        relay.thaw()
        before_m = graph.robot.path_length_m
        with repeated(lambda: viewer.command(0.2)):
            time.sleep(1.5)
            assert graph.robot.path_length_m - before_m < 0.02
        press_until_it_drives(graph, lambda: viewer.command(0.2))


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"", "expected geometry_msgs/Twist as json"),
        (b"[1]", "expected geometry_msgs/Twist as json"),
        (b'{"linear": 3}', "expected geometry_msgs/Twist as json"),
        (b'{"linear": {"x": "fast"}}', "linear.x: expected a number"),
        (b'{"linear": {"x": true}}', "linear.x: expected a number"),
        (b'{"linear": {"x": NaN}}', "not a finite number"),
        (b'{"linear": {"x": 1e999}}', "not a finite number"),
        (b'{"linear": {"x": 1' + b"0" * 400 + b"}}", "expected geometry_msgs/Twist"),
        (b"[" * 100_000, "expected geometry_msgs/Twist as json"),
    ],
)
def test_what_is_no_command_is_refused(content: bytes, why: str) -> None:
    with watched() as (address, heard), Viewer(address) as viewer:
        viewer.advertise()
        viewer.publish(content)
        assert why in viewer.said()["message"]
        assert not heard


@pytest.mark.parametrize(
    ("encoding", "topic", "kind"),
    [("ros1", "/cmd_vel", "geometry_msgs/Twist"), ("json", "/stop", "std_msgs/Bool"), ("cdr", "/cmd_vel", "x")],
)
def test_other_messages_are_refused(encoding: str, topic: str, kind: str) -> None:
    with watched() as (address, heard), Viewer(address) as viewer:
        viewer.advertise(encoding, topic, kind)
        viewer.publish(json.dumps({"linear": {"x": 1.0}, "data": True}).encode())
        assert "only commands are taken" in viewer.said()["message"]
        viewer.socket.send(b"\x02")
        assert "expected the data of a message" in viewer.said()["message"]
        assert not heard


@contextmanager
def watched() -> Iterator[tuple[str, list[Twist]]]:
    transport, heard = InProcessTransport(), list[Twist]()
    transport.subscribe("probe", STEERING_CMD_VEL, lambda received: heard.append(received.message))
    node = SteeringNode(transport, RealClock())
    server = LiveServer(transport, RealClock(), (STEERING_CMD_VEL,), FoxgloveConfig(port=0), Driving(node, Seat()))
    try:
        yield server.start(), heard
    finally:
        server.stop()
        node.stop()
        transport.close()


@contextmanager
def served_beside(page: PageProcess, graph: Graph) -> Iterator[str]:
    """Serve topics as ``handsteer run`` does beside a page; the page must not be served yet."""
    live = LiveProcess()
    live.share_seat(page.seat)
    page.on_driver = live.note_driver
    try:
        yield live.serve(graph.transport, graph.clock, graph.topics, FoxgloveConfig(port=0, drive=True))
    finally:
        live.stop()


def note_audit(graph: Graph, told: list[str]) -> None:
    graph.transport.subscribe(
        "probe", AUDIT, lambda received: told.append(f"{received.message.name} {received.message.msg}")
    )


@pytest.mark.slow
def test_beside_a_page_without_viewers_a_program_takes_the_seat() -> None:
    with standing(steering=False) as graph:
        told: list[str] = []
        note_audit(graph, told)
        page = PageProcess()
        try:
            with served_beside(page, graph) as address:
                page.serve(graph)
                with Viewer(address) as viewer:
                    viewer.advertise()
                    tap(lambda: viewer.command(0.2))
                    eventually(lambda: "Foxglove 1 took the seat, which was free" in told)
                    press_until_it_drives(graph, lambda: viewer.command(0.2))
                eventually(lambda: stands(graph))
                eventually(lambda: "Foxglove 1 left the seat" in told)
        finally:
            page.stop()


class TestBesideAViewer:
    """A program asks for the seat of a viewer of the page, who hands it over, and stops the robot all the same."""

    pytestmark = NEEDS_A_BROWSER

    def test_the_driver_hands_over_and_can_stop(self) -> None:
        with standing(steering=False) as graph, a_browser() as browser:
            told: list[str] = []
            note_audit(graph, told)
            process = PageProcess()
            try:
                with served_beside(process, graph) as address, Viewer(address) as viewer:
                    page = browser.new_page()
                    page.goto(process.serve(graph))
                    self.drive_by_pad(page, graph)
                    viewer.advertise()
                    viewer.command(0.2)
                    assert "another one drives the robot" in viewer.said()["message"]
                    page.get_by_role("button", name="Hand over").click()
                    eventually(lambda: any("Foxglove 1 took the seat" in words for words in told))
                    tap(lambda: viewer.command(0.2))
                    with repeated(lambda: viewer.command(0.2)):
                        eventually(lambda: speed(graph) > 0.1)
                        page.get_by_role("button", name="Stop the robot").click()
                        eventually(lambda: stands(graph))
            finally:
                process.stop()

    @staticmethod
    def drive_by_pad(page: Page, graph: Graph) -> None:
        ask = page.get_by_role("button", name="Ask to drive")
        eventually(lambda: ask.is_visible() or page.locator(".steer.yours").count())
        if ask.is_visible():
            ask.click()
        page.locator(".steer.yours").wait_for()
        page.keyboard.down("KeyW")
        eventually(lambda: speed(graph) > 0.05)
        page.keyboard.up("KeyW")
        eventually(lambda: stands(graph))
