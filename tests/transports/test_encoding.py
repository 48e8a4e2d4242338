import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.messages import Header, Image, String, Time, twist
from handsteer.transports.encoding import decode, encode, request_type, type_hash, types

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


LIST = "rcl_interfaces/srv/ListParameters"
# As ROS 2 Jazzy has them, in share/rcl_interfaces/srv/*.json.
PUBLISHED = {
    "ListParameters": "3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d",
    "GetParameters": "bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc",
    "GetParameterTypes": "da199c878688b3e530bdfe3ca8f74cb9fa0c303101e980a9e8f260e25e1c80ca",
    "DescribeParameters": "845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff",
    "SetParameters": "56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0",
    "SetParametersAtomically": "0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd",
    "ListParameters_Request": "a1b0b5d6b967a5b8ac5bc8563c3ea678f349e312a6a4967227c5a96bc5ce38df",
    "ListParameters_Response": "31b937b82de3612426be79f231e386259f97e8dc843e3f2845288b4bfa296bdd",
    "SetParameters_Request": "130d46386b7e84ea9ecf60608a4d83cbe5e5cb7c6cc5b712b7a4e3a6c254e932",
    "DescribeParameters_Response": "ad6747319613c6131589e062e095b469a46cc764f7d0f12a001a49e6cd893995",
    "SetParameters_Event": "5060f52369bcff7f9dbd6eca21ee521859e471e71b33a8a8df26d5236fe54a80",
}


@pytest.mark.parametrize(("name", "digest"), PUBLISHED.items())
def test_hashes_are_those_that_ros2_publishes(name: str, digest: str) -> None:
    assert type_hash(f"rcl_interfaces/srv/{name}") == f"RIHS01_{digest}"


def test_a_request_is_on_the_wire_as_its_definition_says() -> None:
    request = types().types[request_type(LIST)](prefixes=["a"], depth=2)
    # One string of two bytes with its end, padding to eight, then a uint64.
    body = "01000000 02000000 6100 000000000000 0200000000000000"
    assert encode(request) == bytes.fromhex(f"00010000 {body}")
    assert decode(encode(request), request_type(LIST)).depth == 2
