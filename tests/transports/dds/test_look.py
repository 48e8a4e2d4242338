import pytest

pytest.importorskip("cyclonedds")

from handsteer.transports.dds.look import ObservedTopic, problems_of

TWIST, STRING = "geometry_msgs/msg/Twist", "std_msgs/msg/String"


def topic(name: str, *types: str, publishers: tuple[str, ...] = ()) -> ObservedTopic:
    return ObservedTopic(name, types, publishers)


def test_nothing_is_amiss() -> None:
    driven = topic("/cmd_vel", TWIST, publishers=("/a",))
    said = topic("/chatter", STRING, publishers=("/a", "/b"))
    assert problems_of(["/a", "/b"], [driven, said]) == []


def test_two_drivers_two_types_and_two_nodes_of_one_name() -> None:
    (named, driven, typed) = problems_of(
        ["/a", "/a", "/b"], [topic("/cmd_vel", TWIST, publishers=("/a", "/b")), topic("/x", STRING, TWIST)]
    )
    assert named.startswith("2 nodes have the name /a: end one of them")
    assert driven.startswith("/cmd_vel has 2 publishers (/a, /b), and a robot obeys all of them in turn: end all but")
    assert typed == f"/x has the types {STRING} and {TWIST}: only those of one type are connected"
