"""The names of status reports on ``/diagnostics``, which all namespaces share."""


def split_reporter(name: str) -> tuple[str, str]:
    """Return the namespace and the node of a status: ``r1/cam: my_camera`` gives ``r1`` and ``my_camera``.

    A node without a process of its own reports under its name alone, and has no namespace.
    """
    process, _, node = name.rpartition(": ")
    return process.rpartition("/")[0], node
