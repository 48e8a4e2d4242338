import numpy as np

from handsteer.plugins.record.replay.drive_facts import Curve


def curve(count: int) -> Curve:
    made = Curve(2)
    for n in range(count):
        made.add(n, 1.0 if n == count // 3 else 0.0)
    return made


def test_a_short_curve_is_whole() -> None:
    table = curve(100).table()
    assert table.shape == (100, 2)
    assert list(table[:, 0]) == list(range(100))


def test_a_long_curve_is_thinned_and_keeps_its_extremes() -> None:
    table = curve(90_000).table(1000)
    assert 500 <= len(table) <= 1000
    assert (np.diff(table[:, 0]) > 0).all()
    assert table[:, 1].max() == 1.0


def test_an_endless_curve_takes_bounded_memory() -> None:
    made = curve(1_000_000)
    assert 200_000 <= len(made) < 400_000
    assert made.table()[-1, 0] > 990_000


def test_an_empty_curve() -> None:
    assert Curve(3).table().shape == (0, 3)
