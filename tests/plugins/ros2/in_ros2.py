"""The transport by rclpy, where rclpy is: ``tests/ros2/test_rclpy.py`` runs this by the Python of ``make ros2``."""

import logging
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rcl_interfaces.msg import Parameter as TheirParameter
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.duration import Duration
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile
from std_msgs.msg import Bool as TheirBool
from std_msgs.msg import String as TheirString

from handsteer.clock import SimulatedClock
from handsteer.config import Config
from handsteer.errors import TransportError
from handsteer.messages import (
    CAMERA_INFO,
    CMD_VEL,
    HAND_SIGN,
    IMAGE_COMPRESSED,
    IMAGE_RAW,
    ROBOT_DESCRIPTION,
    SELECTED_ROBOT,
    STOP,
    TF,
    String,
    TFMessage,
    Topic,
)
from handsteer.parameters import NodeParameters
from handsteer.plugins.ros2.topics import publisher_qos, subscription_qos
from handsteer.testing.transport_contract import SessionContract, eventually, heard
from handsteer.transports import join
from handsteer.transports.base import Session
from tests.dds.graph import free_domain

Join = Callable[..., Session]


@pytest.fixture(autouse=True)
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    number = free_domain()
    monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    return number


@pytest.fixture
def joined() -> Iterator[Join]:
    sessions: list[Session] = []

    def join_as(*words: str) -> Session:
        sessions.append(join("ros2", "tests", ["--ros-args", *words] if words else []))
        return sessions[-1]

    yield join_as
    for session in sessions:
        session.close()


@contextmanager
def other_node(domain: int) -> Iterator[Any]:
    """A node ``/other`` of plain rclpy, for as long as the block lasts."""
    context = rclpy.Context()
    context.init(args=[], domain_id=domain)
    node = rclpy.create_node("other", context=context)
    try:
        yield node
    finally:
        node.destroy_node()
        context.shutdown()


class TestRclpy(SessionContract):
    @pytest.fixture
    def session(self, joined: Join, caplog: pytest.LogCaptureFixture) -> Session:
        session = joined("-r", "__ns:=/r1")
        # What handsteer logs goes to rclpy alone, and the contract looks for it here.
        logging.getLogger("handsteer").addHandler(caplog.handler)
        return session


def test_a_type_that_this_ros2_lacks_is_said_once_and_left_out(
    joined: Join, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "tf2_msgs.msg", None)
    transport = joined().transport
    publisher = transport.advertise("robot", TF)
    transport.subscribe("listener", TF, lambda _: None)
    publisher.publish(TFMessage(transforms=[]))
    time.sleep(0.2)
    assert not publisher.has_subscribers
    said = capfd.readouterr().err
    assert said.count("/tf is left out: this ROS 2 lacks the package tf2_msgs") == 1
    with pytest.raises(TransportError, match="/tf carries tf2_msgs/msg/TFMessage, not std_msgs/msg/String"):
        publisher.publish(String(data="no"))  # type: ignore[arg-type]


def test_the_compressed_topic_and_camera_info_move_with_the_images(joined: Join) -> None:
    transport = joined("-r", "image_raw:=/eye/picture", "-r", "__ns:=/r1").transport
    assert transport.topic_name(CAMERA_INFO) == "/eye/camera_info"
    publishers = [transport.advertise("camera", topic) for topic in (IMAGE_RAW, IMAGE_COMPRESSED)]
    other = joined("-r", "image_raw:=/eye/picture", "-r", "image_raw/compressed:=/far").transport
    publishers.append(other.advertise("camera", IMAGE_COMPRESSED))
    looker = joined("-r", "__node:=looker")
    for name in ("/eye/picture", "/eye/picture/compressed", "/far"):
        topic = Topic(name, IMAGE_COMPRESSED.type if name != "/eye/picture" else IMAGE_RAW.type, is_global=True)
        assert eventually(partial(looker.transport.publishers_of, topic)), name
    assert len(publishers) == 3


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("image_raw=/x",), "'image_raw=/x' is not a valid argument of ROS 2: it should be as --ros-args -r"),
        (("--ros-args", "-r", "image_raw"), "cannot join ROS 2 as tests"),
        (("--ros-args", "--nonsense"), "cannot join ROS 2 as tests"),
        (("--ros-args", "-r", "__node:=1x"), "cannot join ROS 2 as tests"),
        (("--ros-args", "--params-file", "/no/such.yaml"), "cannot join ROS 2 as tests"),
    ],
)
def test_wrong_arguments_are_refused_in_one_line(words: tuple[str, ...], line: str) -> None:
    with pytest.raises(TransportError) as caught:
        join("ros2", "tests", words)
    assert line in str(caught.value)
    assert "\n" not in str(caught.value)


def test_parameters_come_from_files_and_words_and_those_of_ros_are_left_to_it(joined: Join, tmp_path: Path) -> None:
    file = tmp_path / "my.yaml"
    file.write_text("/**: {ros__parameters: {fps: 5, virtual_hand: {script: 'Go:1'}, names: [a, b]}}\n")
    qos = "qos_overrides./gesture/hand_sign.publisher.depth"
    session = joined("--params-file", str(file), "-p", "fps:=15", "-p", "use_sim_time:=true", "-p", f"{qos}:=3")
    assert session.parameters == {"fps": 15, "virtual_hand": {"script": "Go:1"}, "names": ["a", "b"]}
    assert isinstance(session.clock, SimulatedClock)
    # rclpy's own classes show what became of it.
    transport = session.transport
    publisher = transport.advertise("talker", HAND_SIGN)
    assert publisher._writer._publisher.qos_profile.depth == 3  # type: ignore[attr-defined]


def test_an_empty_list_has_no_type_and_is_taken(joined: Join, tmp_path: Path) -> None:
    """Of ``ros2 param dump``, for example: rclpy alone would not start with it."""
    file = tmp_path / "my.yaml"
    file.write_text("/**: {ros__parameters: {robots: [], names: {of: []}, max_linear: 0.5}}\n")
    session = joined("--params-file", str(file))
    assert session.parameters == {"robots": [], "names": {"of": []}, "max_linear": 0.5}
    session.serve(NodeParameters(Config(), "control", lambda _: None))
    assert session._node.get_parameter("robots").value == []  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("kind", "answers"), [(SetParameters, [False, True]), (SetParametersAtomically, [False])], ids=["each", "all"]
)
def test_a_parameter_of_an_unknown_type_is_refused_with_an_answer(
    joined: Join, domain: int, capfd: pytest.CaptureFixture[str], kind: Any, answers: list[bool]
) -> None:
    session = joined()
    applied: list[Config] = []
    session.serve(NodeParameters(Config(), "control", applied.append))
    given = [
        TheirParameter(name="max_linear", value=ParameterValue(type=99)),
        TheirParameter(name="max_angular", value=ParameterValue(type=3, double_value=0.5)),
    ]
    service = "set_parameters" if kind is SetParameters else "set_parameters_atomically"
    with other_node(domain) as node:
        client = node.create_client(kind, f"{session.name}/{service}")
        assert client.wait_for_service(10.0)
        answer = client.call_async(kind.Request(parameters=given))
        executor = rclpy.executors.SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        executor.spin_until_future_complete(answer, 5.0)
        executor.shutdown()
    assert answer.done()
    reply = answer.result()
    results = reply.results if kind is SetParameters else [reply.result]
    assert [each.successful for each in results] == answers
    assert results[0].reason == "max_linear: 99 is not the number of a type of parameters"
    assert len(applied) == sum(answers)
    assert "Traceback" not in capfd.readouterr().err


def test_a_parameter_that_is_set_by_its_old_name_is_reported_by_its_new_one(joined: Join) -> None:
    session = joined()
    session.serve(NodeParameters(Config(), "signs", lambda _: None))
    node = session._node  # type: ignore[attr-defined]
    (result,) = node.set_parameters([Parameter("bridge_time", value=0.3)])
    assert result.successful
    assert node.get_parameter("dropout_hold").value == 0.3
    assert not node.has_parameter("bridge_time")


def test_what_fails_again_and_again_is_logged_once_with_its_place(
    joined: Join, caplog: pytest.LogCaptureFixture
) -> None:
    session = joined()
    logging.getLogger("handsteer").addHandler(caplog.handler)
    failed = 0

    def fail() -> None:
        nonlocal failed
        failed += 1
        raise RuntimeError("broken")

    session._node.create_timer(0.001, fail)  # type: ignore[attr-defined]
    assert eventually(lambda: failed > 3)
    (record,) = [each for each in caplog.records if each.levelno >= logging.ERROR]
    assert record.getMessage() == "/tests: callback of ROS 2 failed"
    assert record.exc_info is not None


def test_a_profile_can_be_overridden_of_what_is_opened_after_the_parameters_are_served(joined: Join) -> None:
    session = joined("-p", "qos_overrides./stop.publisher.depth:=3", "-p", "qos_overrides./stop.subscription.depth:=4")
    session.serve(NodeParameters(Config(), "control", lambda _: None))
    publisher = session.transport.advertise("page", STOP)
    session.transport.subscribe("page", STOP, lambda _: None)
    assert publisher._writer._publisher.qos_profile.depth == 3  # type: ignore[attr-defined]
    by_node = [each.qos_profile for each in session._node.subscriptions if each.topic_name == "/stop"]  # type: ignore[attr-defined]
    assert sorted((each.reliability.name, each.depth) for each in by_node) == [("BEST_EFFORT", 10), ("RELIABLE", 4)]


def test_who_is_not_connected_is_named_once_by_the_names_of_the_graph(
    joined: Join, domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    context = rclpy.Context()
    context.init(args=[], domain_id=domain)
    node = rclpy.create_node("other", context=context)
    qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(TheirString, "/swapped", lambda _: None, qos)
    session = joined("-r", "gesture/hand_sign:=/swapped", "-r", "swapped:=/gesture/hand_sign")
    logging.getLogger("handsteer").addHandler(caplog.handler)
    session.transport.advertise("talker", HAND_SIGN)

    def is_said() -> bool:
        session.wait(0.2)
        return "nothing passes" in caplog.text

    assert eventually(is_said)
    for _ in range(10):
        session.wait(0.2)
    (line,) = [line for line in caplog.text.splitlines() if "nothing passes" in line]
    assert "/swapped: nothing passes between our publisher and the subscriber of /other: the publisher is vol" in line
    node.destroy_node()
    context.shutdown()


BY_TOPIC = {"liveliness": LivelinessPolicy.MANUAL_BY_TOPIC}
ONE_SECOND = {"liveliness_lease_duration": Duration(seconds=1)}


@pytest.mark.parametrize(
    ("request_", "why"),
    [
        (
            {"deadline": Duration(seconds=0.2)},
            "the subscriber has a deadline that the publisher does not promise to meet "
            "(ours: reliable, volatile, no deadline; theirs: reliable, volatile, deadline 0.2 s)",
        ),
        (
            BY_TOPIC | ONE_SECOND,
            "the subscriber wants a liveliness that the publisher does not promise "
            "(ours: reliable, volatile, automatic liveliness; "
            "theirs: reliable, volatile, manual by topic liveliness within 1 s)",
        ),
        (
            ONE_SECOND,
            "the subscriber wants a liveliness that the publisher does not promise "
            "(ours: reliable, volatile, automatic liveliness; "
            "theirs: reliable, volatile, automatic liveliness within 1 s)",
        ),
    ],
    ids=["deadline", "liveliness", "lease"],
)
def test_a_subscriber_that_wants_what_is_not_promised_is_named(
    joined: Join, domain: int, caplog: pytest.LogCaptureFixture, request_: dict[str, Any], why: str
) -> None:
    with other_node(domain) as node:
        node.create_subscription(TheirString, "/gesture/hand_sign", lambda _: None, QoSProfile(depth=1, **request_))
        session = joined()
        logging.getLogger("handsteer").addHandler(caplog.handler)
        session.transport.advertise("talker", HAND_SIGN)
        assert eventually(lambda: not session.wait(0.2) and "nothing passes" in caplog.text)
    line = f"/gesture/hand_sign: nothing passes between our publisher and the subscriber of /other: {why}"
    assert line in caplog.text


def test_a_publisher_that_promises_more_than_we_want_is_connected_and_not_named(
    joined: Join, domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    """What we do not want is endless, which rclpy gives as zero or as a huge number."""
    promised = QoSProfile(depth=1, deadline=Duration(seconds=0.2), **BY_TOPIC, **ONE_SECOND)
    came: list[object] = []
    with other_node(domain) as node:
        publisher = node.create_publisher(TheirString, "/gesture/hand_sign", promised)
        session = joined()
        logging.getLogger("handsteer").addHandler(caplog.handler)
        session.transport.subscribe("listener", HAND_SIGN, came.append)

        def has_come() -> bool:
            publisher.publish(TheirString(data="Stop"))
            return not session.wait(0.2) and bool(came)

        assert eventually(has_come)
        # All are compared at once, so that what is wrong there would be named by now.
        node.create_subscription(TheirBool, "/stop", lambda _: None, QoSProfile(depth=1, **BY_TOPIC))
        session.transport.advertise("page", STOP)
        assert eventually(lambda: not session.wait(0.2) and "/stop: nothing passes" in caplog.text)
    assert "/gesture/hand_sign: nothing passes" not in caplog.text


def test_publishers_of_another_type_are_not_those_of_a_topic(joined: Join, domain: int) -> None:
    context = rclpy.Context()
    context.init(args=[], domain_id=domain)
    node = rclpy.create_node("other", context=context)
    node.create_publisher(TheirBool, "/gesture/hand_sign", 1)
    node.create_publisher(TheirString, "/selected_robot", 1)
    transport = joined().transport
    assert eventually(lambda: transport.publishers_of(SELECTED_ROBOT) == ["/other"])
    assert transport.publishers_of(HAND_SIGN) == []
    node.destroy_node()
    context.shutdown()


@pytest.mark.parametrize("override", ["publisher.depth:=abc", "publisher.reliability:=abc", "publisher.depth:=1.5"])
def test_a_profile_that_is_not_one_is_refused(joined: Join, override: str) -> None:
    session = joined("-p", f"qos_overrides./stop.{override}")
    with pytest.raises(TransportError, match=r"^/stop: "):
        session.transport.advertise("page", STOP)


def test_commands_live_for_less_than_the_robot_waits_and_what_is_latched_stays() -> None:
    assert publisher_qos(CMD_VEL).lifespan.nanoseconds == 350_000_000
    assert publisher_qos(CMD_VEL).depth == subscription_qos(CMD_VEL).depth == 10
    assert publisher_qos(ROBOT_DESCRIPTION).lifespan.nanoseconds == 0  # not said, so without end
    assert publisher_qos(ROBOT_DESCRIPTION).durability.name == "TRANSIENT_LOCAL"


def test_what_cannot_be_read_and_what_is_said_at_the_end(joined: Join, domain: int) -> None:
    """The last message before the end arrives, as a robot's zero has to."""
    context = rclpy.Context()
    context.init(args=[], domain_id=domain)
    node = rclpy.create_node("other", context=context)
    got: list[str] = []
    node.create_subscription(TheirString, "/gesture/hand_sign", lambda m: got.append(m.data), QoSProfile(depth=10))
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)
    session = joined()
    publisher = heard(session.transport.advertise("talker", HAND_SIGN))
    publisher.publish(String(data="last"))
    session.close()
    deadline_s = time.monotonic() + 10.0
    while not got and time.monotonic() < deadline_s:
        executor.spin_once(timeout_sec=0.1)
    assert got == ["last"]
    assert session.wait(0.0)
    executor.shutdown()
    node.destroy_node()
    context.shutdown()


class Idle:
    """A managed node that does nothing."""

    is_active = True

    def set_active(self, is_active: bool) -> bool:
        self.is_active = is_active
        return True


def test_a_managed_node_leaves_the_graph_when_its_session_is_closed(joined: Join, domain: int) -> None:
    """Its process may go on, and not each middleware takes the end of a process for a departure."""
    context = rclpy.Context()
    context.init(args=[], domain_id=domain)
    node = rclpy.create_node("other", context=context)
    session = joined()
    session.manage(Idle())
    assert eventually(lambda: session.name.strip("/") in node.get_node_names())
    session.close()
    assert eventually(lambda: session.name.strip("/") not in node.get_node_names())
    node.destroy_node()
    context.shutdown()


def test_auto_takes_rclpy_where_it_is() -> None:
    session = join("auto", "tests", ())
    assert type(session).__name__ == "RclpySession"
    session.close()
    session.close()
