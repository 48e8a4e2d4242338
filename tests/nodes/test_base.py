import gc
import re
import threading
import time
import weakref
from collections.abc import Iterator
from functools import partial
from unittest.mock import Mock

import pytest

from handsteer.clock import RealClock, SteppedClock, to_stamp
from handsteer.config import Config
from handsteer.messages import DIAGNOSTICS, HAND_SIGN, DiagnosticArray, String, Topic
from handsteer.nodes.base import Node
from handsteer.nodes.callbacks import Inbox
from handsteer.nodes.diagnostics import write_status
from handsteer.nodes.status import CameraStatus
from handsteer.transports.base import Received
from handsteer.transports.in_process import InProcessTransport
from tests.nodes.stepping import Bench
from tests.processes import eventually


def make(name: str = "node") -> tuple[Node, SteppedClock, InProcessTransport]:
    clock, transport = SteppedClock(), InProcessTransport()
    return Node(name, transport, clock), clock, transport


def test_timers_keep_their_period_and_leave_out_missed_beats() -> None:
    node, clock, _ = make()
    beats: list[float] = []
    node.every(0.1, lambda: beats.append(round(clock.now(), 3)))
    for _ in range(5):
        node.spin_once()
        due = node.next_due_s
        assert due is not None
        clock.advance_to(due)
    clock.advance(1.05)
    while node.spin_once():
        pass
    assert beats == [0.0, 0.1, 0.2, 0.3, 0.4, 1.55]


def test_a_timer_that_raises_goes_on() -> None:
    node, clock, _ = make()
    node.every(0.1, lambda: 1 / 0)  # type: ignore[arg-type]
    for _ in range(3):
        node.spin_once()
        clock.advance(0.1)
    assert node.callback_errors == 3


def test_a_delayed_timer_leaves_out_the_beats_before() -> None:
    node, clock, _ = make()
    beats: list[float] = []
    timer = node.every(0.1, lambda: beats.append(round(clock.now(), 3)))
    timer.delay_until(0.5)
    for _ in range(8):
        node.spin_once()
        clock.advance(0.1)
    assert beats == [0.5, 0.6, 0.7]


def test_state_is_worked_out_only_while_somebody_listens() -> None:
    bench = Bench()
    node = Node("node", bench.transport, bench.clock)
    bench.nodes.append(node)
    reports: list[float] = []

    def report() -> CameraStatus:
        reports.append(bench.clock.now())
        return CameraStatus()

    node.diagnose_every(0.1, report)
    bench.run(3.0)
    assert reports == []
    bench.record(DIAGNOSTICS)
    bench.run(1.0)
    assert 3.0 <= reports[0] <= 3.5
    assert len(reports) >= 5


def test_with_a_key_the_newest_of_each_publisher_is_kept() -> None:
    node, _, transport = make("page")
    got: list[str] = []

    def callback(received: Received[DiagnosticArray]) -> None:
        got.append(f"{received.message.status[0].name} {received.message.status[0].message}")

    node.subscribe(DIAGNOSTICS, callback, key=lambda message: message.status[0].name)
    for name in ("a", "b"):
        reports = transport.advertise(name, DIAGNOSTICS)
        for status in (CameraStatus("old"), CameraStatus("new", "delivers")):
            reports.publish(write_status(status, name, to_stamp(0.0)))
    node.spin_once()
    assert sorted(got) == ["a new: delivers frames", "b new: delivers frames"]


def test_a_closed_subscription_processes_nothing_more_and_leaves_nothing_behind() -> None:
    node, _, transport = make()
    signs = transport.advertise("other", HAND_SIGN)
    heard: list[str] = []
    inboxes = weakref.WeakSet[Inbox[String]]()
    for _ in range(3):
        subscription = node.subscribe(HAND_SIGN, lambda received: heard.append(received.message.data))
        inboxes.update(node._inboxes)
        signs.publish(String(data="Forward"))
        subscription.close()
        node.spin_once()
    del subscription
    gc.collect()
    assert heard == []
    assert not inboxes


def test_the_thread_sleeps_until_there_is_work_and_ends_at_stop() -> None:
    transport = InProcessTransport()
    node = Node("node", transport, RealClock())
    topic = Topic("/number", int)
    served = threading.Event()
    node.subscribe(topic, lambda _: served.set())
    node.start()
    transport.advertise("other", topic).publish(1)
    assert served.wait(5)
    node.stop()
    node.stop()
    assert not any(thread.name == "node" for thread in threading.enumerate())


def test_a_callback_that_exits_has_failed_and_the_thread_goes_on() -> None:
    transport, called = InProcessTransport(), threading.Semaphore(0)
    node = Node("node", transport, RealClock())
    topic = Topic("/number", int)

    def leave(_: Received[int]) -> None:
        called.release()
        raise SystemExit(0)

    node.subscribe(topic, leave)
    node.start()
    numbers = transport.advertise("other", topic)
    for _ in range(2):
        numbers.publish(1)
        assert called.acquire(timeout=5)
    node.stop()
    assert node.callback_errors == 2


def test_on_stop_is_called_even_when_it_raises() -> None:
    class Bad(Node):
        def on_stop(self) -> None:
            raise RuntimeError("boom")

    node = Bad("bad", InProcessTransport(), SteppedClock())
    node.stop()
    assert node.callback_errors == 1


def test_on_stop_is_called_even_when_a_subscription_does_not_end() -> None:
    ended: list[str] = []

    class Ends(Node):
        def on_stop(self) -> None:
            ended.append(self.name)

    node = Ends("ends", InProcessTransport(), SteppedClock())
    node.subscribe(Topic("/number", int), lambda _: None).close = Mock(side_effect=OSError)  # type: ignore[method-assign]
    node.stop()
    assert ended == ["ends"]


def test_a_callback_that_hangs_does_not_hold_up_the_end() -> None:
    transport = InProcessTransport()
    node = Node("node", transport, RealClock())
    topic, started, let_go = Topic("/number", int), threading.Event(), threading.Event()

    def callback(_: Received[int]) -> None:
        started.set()
        let_go.wait(30)

    node.subscribe(topic, callback)
    node.start()
    transport.advertise("other", topic).publish(1)
    assert started.wait(5)
    node.stop(timeout_s=0.05)
    assert node.stuck
    let_go.set()


def test_a_configuration_is_taken_on_the_nodes_thread_without_waiting_for_anything() -> None:
    taken: list[tuple[Config, int | None]] = []

    class Taking(Node):
        def on_reconfigure(self, config: Config) -> None:
            taken.append((config, threading.get_ident()))

    node = Taking("node", InProcessTransport(), RealClock())
    node.start()
    config = Config()
    node.reconfigure(config)
    eventually(lambda: taken)
    node.stop()
    assert taken[0][0] is config
    assert taken[0][1] != threading.get_ident()


def test_a_configuration_that_fails_is_counted_and_the_node_goes_on() -> None:
    class Failing(Node):
        def on_reconfigure(self, config: Config) -> None:
            raise ValueError("odd")

    node = Failing("node", InProcessTransport(), SteppedClock())
    node.reconfigure(Config())
    assert node.spin_once()
    assert node.callback_errors == 1
    assert not node.spin_once()


def test_what_fails_again_and_again_is_said_once_with_its_traceback_and_then_counted(
    caplog: pytest.LogCaptureFixture,
) -> None:
    clock, transport, topic = SteppedClock(), InProcessTransport(), Topic("/number", int)
    node = Node("node", transport, clock)
    publisher = transport.advertise("other", topic)

    def fail(received: Received[int]) -> None:
        raise ValueError("odd" * 1000)

    node.subscribe(topic, fail)
    for number in range(900):
        publisher.publish(number)
        node.spin_once()
        clock.advance(1 / 30)
    assert node.callback_errors == 900
    assert [record.exc_info is not None for record in caplog.records] == [True, False, False]
    assert re.match(r"node: callback of /number has failed 60\d times: odd", caplog.records[-1].getMessage())
    assert len(caplog.records[-1].getMessage()) < 300


def test_another_failure_is_said_at_once(caplog: pytest.LogCaptureFixture) -> None:
    transport, topic = InProcessTransport(), Topic("/number", int)
    node = Node("node", transport, SteppedClock())
    publisher = transport.advertise("other", topic)

    def fail(received: Received[int]) -> None:
        raise (ValueError if received.message else KeyError)(received.message)

    node.subscribe(topic, fail)
    for number in (0, 1, 1, 0):
        publisher.publish(number)
        node.spin_once()
    assert [record.exc_info and record.exc_info[0] for record in caplog.records] == [KeyError, ValueError]


class QuickNode(Node):
    is_quick = True


@pytest.fixture
def quick() -> Iterator[tuple[InProcessTransport, QuickNode]]:
    transport = InProcessTransport()
    node = QuickNode("quick", transport, RealClock())
    yield transport, node
    node.stop()


def test_a_quick_node_is_served_by_the_thread_that_delivers(quick: tuple[InProcessTransport, QuickNode]) -> None:
    transport, node = quick
    threads: list[threading.Thread] = []
    node.subscribe(HAND_SIGN, lambda _: threads.append(threading.current_thread()))
    node.start()
    talker = transport.advertise("talker", HAND_SIGN)
    for number in range(20):
        talker.publish(String(data="Go"))

        def is_heard(number: int = number) -> bool:
            return len(threads) > number

        eventually(is_heard)
    eventually(lambda: len(threads) == 20)
    assert threading.current_thread() in threads


def test_a_quick_node_hears_nothing_before_its_start(quick: tuple[InProcessTransport, QuickNode]) -> None:
    transport, node = quick
    came = threading.Event()
    node.subscribe(HAND_SIGN, lambda _: came.set())
    transport.advertise("talker", HAND_SIGN).publish(String(data="Go"))
    assert not came.is_set()
    node.start()
    assert came.wait(10)


def test_callbacks_of_a_quick_node_never_run_side_by_side_and_none_is_lost(
    quick: tuple[InProcessTransport, QuickNode],
) -> None:
    transport, node = quick
    inside, most, sums = [0], [0], {name: 0 for name in ("/a", "/b", "/c")}

    def callback(name: str, received: Received[String]) -> None:
        inside[0] += 1
        most[0] = max(most[0], inside[0])
        time.sleep(0.0002)
        sums[name] = int(received.message.data)
        inside[0] -= 1

    def talk(name: str) -> None:
        talker = transport.advertise("talker", Topic(name, String))
        for number in range(1, 301):
            talker.publish(String(data=str(number)))

    for name in sums:
        node.subscribe(Topic(name, String), partial(callback, name))
    node.every(0.001, lambda: None)
    node.start()
    talkers = [threading.Thread(target=talk, args=(name,)) for name in sums]
    for each in talkers:
        each.start()
    for each in talkers:
        each.join()
    eventually(lambda: set(sums.values()) == {300}, what="the newest of each topic")
    assert most == [1]


def test_a_quick_node_may_publish_to_itself(quick: tuple[InProcessTransport, QuickNode]) -> None:
    transport, node = quick
    again, done = node.publisher(Topic("/again", String)), threading.Event()
    node.subscribe(HAND_SIGN, lambda received: again.publish(received.message))
    node.subscribe(Topic("/again", String), lambda _: done.set())
    node.start()
    transport.advertise("talker", HAND_SIGN).publish(String(data="Go"))
    assert done.wait(10)


def test_a_quick_node_that_hangs_is_said_to_be_stuck(quick: tuple[InProcessTransport, QuickNode]) -> None:
    transport, node = quick
    inside, let_go = threading.Event(), threading.Event()

    def hang(_: object) -> None:
        inside.set()
        let_go.wait(10)

    node.subscribe(HAND_SIGN, hang)
    node.start()
    talker = threading.Thread(
        target=lambda: transport.advertise("talker", HAND_SIGN).publish(String(data="Go")), daemon=True
    )
    talker.start()
    assert inside.wait(10)
    node.stop(0.05)
    assert node.stuck
    let_go.set()
