import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.messages import Header, Image, String, Time, twist
from handsteer.transports.ros2.encoding import dds_type_name, decode, encode, ros_type_name, type_hash, types

FINITE = st.floats(allow_nan=False)


@given(FINITE, FINITE)
def test_a_twist_comes_back(linear: float, angular: float) -> None:
    message = twist(linear, angular)
    assert decode(encode(message), "geometry_msgs/msg/Twist") == message


@given(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=30))
def test_a_text_comes_back(text: str) -> None:
    assert decode(encode(String(data=text)), "std_msgs/msg/String") == String(data=text)


@given(st.integers(0, 2**31 - 1), st.integers(0, 10**9 - 1), st.binary(max_size=50))
def test_an_image_comes_back_as_a_view(sec: int, nanosec: int, data: bytes) -> None:
    header = Header(stamp=Time(sec, nanosec), frame_id="camera")
    sent = Image(header, 1, len(data), "mono8", 0, len(data), np.frombuffer(data, np.uint8))
    got = decode(encode(sent), "sensor_msgs/msg/Image")
    assert (got.header, got.width, got.data.tobytes()) == (header, len(data), data)
    assert not got.data.flags.owndata


def test_the_bytes_are_those_of_ros2() -> None:
    assert encode(String(data="Go")) == bytes.fromhex("00010000 03000000 476f00")


@pytest.mark.parametrize(
    ("name", "digest"),
    [
        ("geometry_msgs/msg/Twist", "9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"),
        ("std_msgs/msg/String", "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"),
        (
            "rmw_dds_common/msg/ParticipantEntitiesInfo",
            "91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e",
        ),
    ],
)
def test_hashes_are_those_of_ros2(name: str, digest: str) -> None:
    assert type_hash(name) == f"RIHS01_{digest}"


@pytest.mark.parametrize(("distribution", "length"), [("humble", 24), ("jazzy", 16)])
def test_identifiers_have_the_length_of_the_distribution(distribution: str, length: int) -> None:
    fields = dict(types(distribution).fielddefs["rmw_dds_common/msg/Gid"][1])
    assert fields["data"][1][1] == length


def test_names_in_dds() -> None:
    assert dds_type_name("geometry_msgs/msg/Twist") == "geometry_msgs::msg::dds_::Twist_"
    assert ros_type_name("geometry_msgs::msg::dds_::Twist_") == "geometry_msgs/msg/Twist"
