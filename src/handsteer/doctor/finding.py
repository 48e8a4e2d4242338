"""The result of one check."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "optional", "wrong", "missing"]


@dataclass(frozen=True)
class Finding:
    """The result of one check.

    Attributes:
        name: The subject: ``camera``, ``models``, ``port``...
        verdict: ``ok``; ``optional`` if missing, but handsteer works without it; ``wrong`` if present, but probably not
            as intended; ``missing`` if handsteer does not work without it.
        detail: What was found, and how to fix a problem.
    """

    name: str
    verdict: Verdict
    detail: str
