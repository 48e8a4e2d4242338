"""Looks at ROS 2 domains by processes of their own, so that a broken configuration breaks them and not who asks."""

import json
import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

_TIMEOUT_S = 20.0
# Cyclone DDS begins its lines with the time, the domain and the program.
_ENGINE_LINE = re.compile(r"^\d+\.\d+ \[\d+\]\s+\S+: (.*)$", re.MULTILINE)


@dataclass(frozen=True)
class Sight:
    """What was seen in a domain.

    Attributes:
        graph: As :meth:`~handsteer.transports.observed.ObservedGraph.as_dict` has it; None when it cannot be joined.
        problem: Why it cannot be joined: what the engine says, or else what we say.
    """

    graph: dict[str, Any] | None
    problem: str = ""

    @property
    def others(self) -> list[str]:
        """The nodes in the domain, and topics of those that have no name."""
        graph = self.graph or {"nodes": [], "topics": []}
        return [*graph["nodes"]] or [topic["name"] for topic in graph["topics"]]


def look(environments: Mapping[int, Mapping[str, str]]) -> dict[int, Sight]:
    """Return what is seen in each domain, all at the same time.

    Args:
        environments: The environment variables with which each domain is looked at.
    """
    processes = {
        domain: subprocess.Popen(
            [sys.executable, "-m", "handsteer.transports.look"],
            env={**environment, "ROS_DOMAIN_ID": str(domain)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for domain, environment in environments.items()
    }
    return {domain: _sight(process) for domain, process in processes.items()}


def _sight(process: subprocess.Popen[str]) -> Sight:
    try:
        out, words = process.communicate(timeout=_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return Sight(None, f"there was no answer within {_TIMEOUT_S:.0f} s")
    if process.returncode == 0:
        return Sight(json.loads(out))
    said = _ENGINE_LINE.findall(words) or words.strip().splitlines()[-1:] or [f"exit code {process.returncode}"]
    return Sight(None, "; ".join(said))
