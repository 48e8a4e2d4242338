"""Messages as ROS 2 has them on the wire: CDR with its header of four bytes, and the names and hashes of types."""

import dataclasses
import functools
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from handsteer.messages import TurtlePose

_FLOAT32: Any = (Nodetype.BASE, ("float32", 0))
_DISCOVERY = "rmw_dds_common/msg/ParticipantEntitiesInfo"
# The hash leaves out what rosbags cannot tell: that ROS 2 makes a uint8 of a char.
_KNOWN_HASHES = {_DISCOVERY: "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"}


@functools.cache
def types(distribution: str = "jazzy") -> Typestore:
    """Return the message types of a ROS 2 distribution: ``humble`` or newer ones, which are alike, ``jazzy``."""
    store = get_typestore(Stores.ROS2_HUMBLE if distribution == "humble" else Stores.ROS2_JAZZY)
    store.register({TurtlePose.__msgtype__: ([], [(part.name, _FLOAT32) for part in dataclasses.fields(TurtlePose)])})
    return store


def encode(message: Any) -> bytes:
    """Return ``message`` as little-endian CDR."""
    return bytes(types().serialize_cdr(message, message.__msgtype__))


def decode(raw: bytes, name: str) -> Any:
    """Return the message of the type ``name`` (``std_msgs/msg/String``); its arrays are read-only views of ``raw``.

    Raises:
        Exception: ``raw`` is no such message; rosbags raises whatever it stumbles over.
    """
    return types().deserialize_cdr(raw, name)


def type_hash(name: str) -> str:
    """Return the hash of the type ``name``, as ``RIHS01_df66…`` (ROS REP 2016)."""
    return _KNOWN_HASHES.get(name) or types().hash_rihs01(name)
