"""What an examination comes to."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "optional", "wrong", "missing"]


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        name: What it is: ``camera``, ``models``, ``port``...
        verdict: ``ok``; ``optional`` when it is not there, but handsteer works without; ``wrong`` when it is there, but
            will not do what was probably meant; ``missing`` when handsteer does not work without.
        detail: What was found, and what to do where something is amiss.
    """

    name: str
    verdict: Verdict
    detail: str
