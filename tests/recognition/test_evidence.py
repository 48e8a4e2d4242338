import pytest

from handsteer.recognition.debouncer import Evidence
from handsteer.recognition.hand_selector import HandPosition

DT = 1 / 30


def seen(*x: float, likelihood: float = 0.9) -> Evidence:
    evidence = Evidence()
    for each in x:
        evidence.add(HandPosition(each, 200.0, 100.0), {"Forward": likelihood}, DT)
    return evidence


def test_a_trembling_hand_is_still_and_one_that_passes_by_is_not() -> None:
    assert seen(300, 303, 298, 301, 304).is_still(0.1)
    assert not seen(300, 315, 330, 345, 360).is_still(0.1)


def test_only_the_last_moments_matter() -> None:
    assert seen(100, 200, 300, 300, 300, 300, 300).is_still(0.1)
    assert not seen(100, 200, 300, 300, 300, 300, 300).is_still(0.2)


def test_a_hand_that_has_just_come_is_judged_by_what_there_is() -> None:
    assert seen(300).is_still(0.1)
    assert not Evidence().is_still(0.1)


def test_the_likelihood_is_the_mean_of_the_last_moments() -> None:
    evidence = seen(300, 300, likelihood=0.2)
    for _ in range(3):
        evidence.add(HandPosition(300.0, 200.0, 100.0), {"Forward": 0.8}, DT)
    assert evidence.likelihood("Forward", 2 * DT) == pytest.approx(0.8)
    assert evidence.likelihood("Forward", 1.0) == pytest.approx(0.56)
    assert evidence.likelihood("Go", 1.0) == 0.0


def test_a_hand_out_of_view_forgets_and_a_long_stream_does_not_grow() -> None:
    evidence = seen(*[300.0] * 1000, likelihood=0.1)
    for _ in range(12):
        evidence.add(HandPosition(300.0, 200.0, 100.0), {"Forward": 1.0}, DT)
    assert evidence.likelihood("Forward", 1e9) == pytest.approx(1.0)
    evidence.add(None, {}, DT)
    assert evidence.likelihood("Forward", 1.0) == 0.0
