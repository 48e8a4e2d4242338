"""ROS 2's own classes of messages and services, if they are installed."""

import importlib
from typing import Any


def ros_class(name: str) -> Any | None:
    """Return ROS 2's class for the type ``name``, as ``std_msgs/msg/String``; None if its package is missing."""
    package, kind, of = name.split("/")
    try:
        found = getattr(importlib.import_module(f"{package}.{kind}"), of, None)
    except ImportError:
        return None
    # A ROS 1 package of the same name does not have this type support.
    return found if hasattr(type(found), "__import_type_support__") else None
