"""Which ROS 2 domain to join: nodes of different domains never see each other."""

from collections.abc import Mapping

from handsteer.errors import TransportError

_LARGEST = 232  # those above have no UDP ports in DDS


def domain_id(environment: Mapping[str, str]) -> int:
    """Return ``ROS_DOMAIN_ID``, 0 to 232, of ``environment``; 0 when it is not set.

    Raises:
        TransportError: It has a value that is not allowed.
    """
    text = environment.get("ROS_DOMAIN_ID", "")
    if not text:
        return 0
    if not (text.isascii() and text.isdigit() and int(text) <= _LARGEST):
        raise TransportError(f"ROS_DOMAIN_ID is {text!r}: it should be a whole number from 0 to {_LARGEST}")
    return int(text)
