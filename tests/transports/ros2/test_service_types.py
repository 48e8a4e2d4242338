import pytest

from handsteer.transports.ros2.encoding import decode, encode, type_hash, types
from handsteer.transports.ros2.service_types import LIST_PARAMETERS

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
    request = types().types[LIST_PARAMETERS.request](prefixes=["a"], depth=2)
    # One string of two bytes with its end, padding to eight, then a uint64.
    body = "01000000 02000000 6100 000000000000 0200000000000000"
    assert encode(request) == bytes.fromhex(f"00010000 {body}")
    assert decode(encode(request), LIST_PARAMETERS.request).depth == 2
