"""Faces that take the place of a hand: what docs/faults.md says of them, and one of them seen again."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.faults.people import Picture, faces, fists, outcome_of, pointing
from tests.faults.table import LIMIT_S, written


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "hand"), [("joystick", fists), ("signs", pointing)])
def test_a_face_in_the_place_of_the_hand_stops_the_robot(
    data_dir: Path, mode: str, hand: Callable[[], Iterator[Picture]]
) -> None:
    assert data_dir
    zero_s, again, _ = outcome_of(mode, hand(), faces()[0])
    assert zero_s <= LIMIT_S
    assert not again


def test_what_was_seen_of_people_holds_too() -> None:
    seen = written("people")
    assert len(seen) == 2
    for where, fault, zero, again, _ in seen:
        assert float(zero) <= LIMIT_S, f"{where}: {fault}"
        assert again == "no", f"{where}: {fault}"
