import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("zenoh")

from handsteer.plugins.ros2.base_transport import Profile
from handsteer.plugins.ros2.names import NodeName
from handsteer.plugins.zenoh.keys import (
    Endpoint,
    Entity,
    Place,
    all_tokens,
    attachment,
    endpoint_token,
    gid,
    node_token,
    read_attachment,
    read_token,
    topic_key,
)

HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
CHATTER = Endpoint("publisher", "/chatter", "std_msgs/msg/String", HASH)
TOKENS = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True)
NAMES = st.lists(TOKENS, min_size=1, max_size=4).map(lambda parts: "/" + "/".join(parts))


def test_topics_have_the_keys_of_rmw_zenohs_design() -> None:
    assert topic_key(0, "/chatter", "std_msgs/msg/String") == f"0/chatter/std_msgs::msg::dds_::String_/{HASH}"
    assert topic_key(2, "/robot1/chatter", "std_msgs/msg/String").startswith("2/robot1/chatter/std_msgs::msg::dds_::")


def test_tokens_are_those_of_rmw_zenohs_design() -> None:
    place = Place(2, "8b20917502ee955ac4476e0266340d5c", NodeName("talker"))
    head = "@ros2_lv/2/8b20917502ee955ac4476e0266340d5c/0"
    assert node_token(place) == f"{head}/0/NN/%/%/talker"
    assert endpoint_token(place, 10, CHATTER, Profile(reliable=True, latched=False, depth=7)) == (
        f"{head}/10/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/{HASH}/::,7:,:,:,,"
    )
    assert all_tokens(2) == "@ros2_lv/2/**"


@pytest.mark.parametrize(
    ("profile", "text"),
    [
        (Profile(reliable=False, latched=False, depth=1), "2::,1:,:,:,,"),
        (Profile(reliable=True, latched=True, depth=1), ":1:,1:,:,:,,"),
        (Profile(reliable=True, latched=False, depth=42), "::,:,:,:,,"),
    ],
)
def test_what_is_default_in_a_profile_is_left_out(profile: Profile, text: str) -> None:
    assert endpoint_token(Place(0, "1f", NodeName("n", "/r1")), 1, CHATTER, profile).rpartition("/")[2] == text


@given(
    kind=st.sampled_from(["publisher", "subscriber", "service", "client"]),
    node=TOKENS,
    namespace=st.just("/") | NAMES,
    topic=NAMES,
    number=st.integers(1, 1000),
)
def test_what_is_written_is_read_again(kind: str, node: str, namespace: str, topic: str, number: int) -> None:
    endpoint = Endpoint(kind, topic, "geometry_msgs/msg/Twist", "RIHS01_00")
    name = NodeName(node, namespace)
    token = endpoint_token(Place(3, "ab12", name), number, endpoint, Profile(reliable=True, latched=False, depth=1))
    assert read_token(token) == Entity("ab12", name.full, endpoint)
    assert read_token(node_token(Place(3, "ab12", name))) is None


@given(st.text("@ros2_lvNMPSC/%:,0a", max_size=60) | st.text(max_size=20).map(lambda text: f"@ros2_lv/0/{text}"))
def test_no_other_token_does_harm(text: str) -> None:
    found = read_token(text)
    assert found is None or text.startswith("@ros2_lv/")


def test_an_endpoint_is_named_by_the_xxh3_hash_of_its_token() -> None:
    # The hash of nothing, as xxHash's own tests have it, is 0x99aa06d3014798d86001c324468d497f.
    assert gid("").hex() == "7f498d4624c30160" + "d8984701d306aa99"


def test_attachments_have_33_bytes() -> None:
    raw = attachment(2, 1_700_000_000_000_000_001, bytes(range(16)))
    assert raw.hex() == "0200000000000000" + raw[8:16].hex() + "10" + bytes(range(16)).hex()
    assert int.from_bytes(raw[8:16], "little") == 1_700_000_000_000_000_001
    assert read_attachment(raw) == (2, 1_700_000_000_000_000_001, bytes(range(16)))


@pytest.mark.parametrize("raw", [b"", bytes(32), bytes(33), bytes(77)])
def test_what_is_no_attachment_is_said(raw: bytes) -> None:
    with pytest.raises(ValueError, match=r"an attachment has 33 bytes, not|has 16 bytes, not 0"):
        read_attachment(raw)
