"""Which photos may be tuned on, and which only report how well that went.

A photo is in one part for good: by its person where each photo shows another one, else by its source. What was tuned on
the one part is judged on the other (docs/signs.md).
"""

import hashlib
from pathlib import PurePath
from typing import Final, Literal

Part = Literal["tune", "report"]

_WHOLE_SETS: Final[dict[str, Part]] = {"emre": "tune", "sld": "report"}
"""Sets of few people, or of people who cannot be told apart: all of such a set is in one part."""


def part_of(path: PurePath | str, person_set: str = "") -> Part:
    """Return the part that a photo is in.

    Args:
        path: The photo; only the name of the file counts, so that folders may be moved.
        person_set: Whose photo it is, as in the column of that name of an ``index.csv``.
    """
    if person_set in _WHOLE_SETS:
        return _WHOLE_SETS[person_set]
    digest = hashlib.sha256(PurePath(path).name.encode()).digest()
    return "report" if digest[0] % 3 == 0 else "tune"
