import pytest

pytest.importorskip("cyclonedds")

from handsteer import messages
from handsteer.messages import Topic, type_name
from handsteer.transports.dds.idl import dds_type
from handsteer.transports.ros2.encoding import dds_type_name

NAMES = sorted({type_name(topic.type) for topic in vars(messages).values() if isinstance(topic, Topic)})


@pytest.mark.parametrize("name", [*NAMES, "rmw_dds_common/msg/ParticipantEntitiesInfo"])
def test_every_type_of_the_graph_has_a_definition_and_lets_bytes_pass(name: str) -> None:
    kind = dds_type(name)
    kind.__idl__.populate()
    kind.__idl__.fill_type_data()
    assert kind.__idl_typename__ == dds_type_name(name)
    assert kind(b"raw").serialize(use_version_2=False) == b"raw"
    assert kind.deserialize(b"raw").raw == b"raw"
