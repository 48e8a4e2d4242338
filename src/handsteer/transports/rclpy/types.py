"""ROS 2's own classes of messages and services, which the installation has or has not."""

import importlib
from typing import Any


def ros_class(name: str) -> Any | None:
    """Return ROS 2's class for the type ``name``, as ``std_msgs/msg/String``; None where its package is missing."""
    package, kind, of = name.split("/")
    try:
        found = getattr(importlib.import_module(f"{package}.{kind}"), of, None)
    except ImportError:
        return None
    # A package of the same name that is ROS 1's has no such classes.
    return found if hasattr(type(found), "__import_type_support__") else None
