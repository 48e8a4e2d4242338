"""What the coordinate frames of several robots are told apart by where they share one tree of transforms."""

from handsteer.config import RobotConfig
from handsteer.messages import TF
from handsteer.transports.protocol import Transport


def frame_prefix(transport: Transport, node: str) -> str:
    """Return what tells the coordinate frames of ``node`` from those of others, as ``r1/``.

    It is empty without a namespace, and where each robot has a tree of its own, as ``/tf`` is remapped.
    """
    namespace = transport.full_name(node).partition(":")[0].rpartition("/")[0]
    return f"{namespace}/" if namespace and transport.topic_name(TF) == TF.name else ""


def prefixed(config: RobotConfig, transport: Transport) -> RobotConfig:
    """Return ``config`` with the names of its frames as they are in the graph: prefixed as ``frame_prefix`` says."""
    prefix = frame_prefix(transport, "robot") if config.frame_prefix == "auto" else config.frame_prefix
    frames = {name: getattr(config, name) for name in ("odom_frame_id", "base_frame_id", "scan_frame_id")}
    return config.model_copy(
        update={name: frame if frame.startswith(prefix) else prefix + frame for name, frame in frames.items()}
    )
