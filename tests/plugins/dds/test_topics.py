import pytest

pytest.importorskip("cyclonedds")

from cyclonedds.core import Policy, Qos

from handsteer import messages
from handsteer.config import RobotConfig
from handsteer.messages import (
    CLOCK,
    CMD_VEL,
    HAND_SIGN,
    IMAGE_RAW,
    ODOM,
    ROBOT_DESCRIPTION,
    STEERING_CMD_VEL,
    Topic,
    type_name,
)
from handsteer.plugins.dds.topics import dds_type, describe, misfits, reader_qos, writer_qos
from handsteer.plugins.ros2.names import dds_type_name

RELIABLE = Policy.Reliability.Reliable(0)


@pytest.mark.parametrize(
    ("topic", "offered", "requested"),
    [
        (CMD_VEL, "reliable, volatile, keep last 10", "reliable, volatile, keep last 10"),
        (HAND_SIGN, "reliable, volatile, keep last 10", "reliable, volatile, keep last 10"),
        (IMAGE_RAW, "reliable, volatile, keep last 3", "best effort, volatile, keep last 1"),
        (CLOCK, "best effort, volatile, keep last 1", "best effort, volatile, keep last 1"),
        (ODOM, "reliable, volatile, keep last 1", "best effort, volatile, keep last 1"),
        (ROBOT_DESCRIPTION, "reliable, transient local, keep last 1", "reliable, transient local, keep last 1"),
    ],
    ids=lambda value: value.name if isinstance(value, Topic) else None,
)
def test_each_kind_of_topic_has_its_profile(topic: Topic[object], offered: str, requested: str) -> None:
    assert describe(writer_qos(topic)) == offered
    assert describe(reader_qos(topic)) == requested
    assert misfits(writer_qos(topic), reader_qos(topic)) == []


@pytest.mark.parametrize("topic", [CMD_VEL, HAND_SIGN, STEERING_CMD_VEL], ids=lambda topic: topic.name)
def test_commands_live_for_less_than_the_robot_waits_for_the_next_one(topic: Topic[object]) -> None:
    lifespan_s = writer_qos(topic)[Policy.Lifespan].lifespan / 1e9
    assert 0.3 < lifespan_s < RobotConfig().cmd_vel_timeout


def test_what_is_no_command_lives_on() -> None:
    assert Policy.Lifespan not in writer_qos(ROBOT_DESCRIPTION)


@pytest.mark.parametrize(
    ("offered", "requested", "word"),
    [
        (Qos(Policy.Reliability.BestEffort), Qos(RELIABLE), "wants reliable"),
        (Qos(Policy.Durability.Volatile), Qos(Policy.Durability.TransientLocal), "wants transient local"),
        (Qos(Policy.Deadline(2)), Qos(Policy.Deadline(1)), "deadline"),
        (Qos(), Qos(Policy.Deadline(1)), "deadline"),
        (Qos(Policy.Liveliness.Automatic(1)), Qos(Policy.Liveliness.ManualByTopic(1)), "liveliness"),
        (Qos(Policy.Liveliness.Automatic(2)), Qos(Policy.Liveliness.Automatic(1)), "liveliness"),
        (Qos(Policy.Ownership.Exclusive), Qos(), "ownership"),
        (Qos(), Qos(Policy.DestinationOrder.BySourceTimestamp), "order"),
    ],
)
def test_what_does_not_fit_one_way_fits_the_other(offered: Qos, requested: Qos, word: str) -> None:
    (reason,) = misfits(offered, requested)
    assert word in reason
    if word != "ownership":  # which has to be the same
        assert misfits(requested, offered) == []
    assert misfits(offered, offered) == []


NAMES = sorted({type_name(topic.type) for topic in vars(messages).values() if isinstance(topic, Topic)})


@pytest.mark.parametrize("name", [*NAMES, "rmw_dds_common/msg/ParticipantEntitiesInfo"])
def test_every_type_of_the_graph_has_a_definition_and_lets_bytes_pass(name: str) -> None:
    kind = dds_type(name)
    kind.__idl__.populate()
    kind.__idl__.fill_type_data()
    assert kind.__idl_typename__ == dds_type_name(name)
    assert kind(b"raw").serialize(use_version_2=False) == b"raw"
    assert kind.deserialize(b"raw").raw == b"raw"
