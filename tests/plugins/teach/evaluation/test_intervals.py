import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.plugins.teach.evaluation.intervals import Rate, Share


@pytest.mark.parametrize(
    ("count", "of", "low", "high"),
    # R. G. Newcombe, "Two-sided confidence intervals for the single proportion", 1998, table I, method 3.
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_shares_of_a_published_table(count: int, of: int, low: float, high: float) -> None:
    assert Share(count, of).interval == pytest.approx((low, high), abs=5e-5)


@pytest.mark.parametrize(
    ("count", "low", "high"),
    # K. Ulm, "A simple method to calculate the confidence interval of a standardized mortality ratio", 1990.
    [(0, 0.0, 3.6889), (1, 0.0253, 5.5716), (5, 1.6235, 11.6683), (10, 4.7954, 18.3904), (100, 81.364, 121.627)],
)
def test_rates_of_a_published_table(count: int, low: float, high: float) -> None:
    assert Rate(count, 60.0).interval == pytest.approx((low, high), abs=5e-4)
    assert Rate(count, 120.0).interval == pytest.approx((low / 2, high / 2), abs=5e-4)


@given(of=st.integers(1, 10**6), part=st.floats(0, 1))
def test_a_share_lies_within_its_interval(of: int, part: float) -> None:
    share = Share(round(of * part), of)
    low, high = share.interval or (1.0, 0.0)
    assert 0.0 <= low <= (share.rate or 0.0) <= high <= 1.0
    assert low < high


def test_nothing_of_nothing_has_no_interval() -> None:
    assert Share(0, 0).interval is None
    assert Share(0, 0).as_dict() == {"count": 0, "of": 0, "rate": None, "low": None, "high": None}
    assert Rate(0, 0.0).interval is None
    assert Rate(3, 0.0).as_dict("bumps") == {
        "bumps_per_minute": 0.0,
        "bumps_per_minute_low": None,
        "bumps_per_minute_high": None,
    }
