"""The gate of ``make bench-signs``: no sign may be lost on photos of people, in a fixed sample of them."""

from pathlib import Path

import pytest
import signs
from _sign_photos import FOLDERS, Eyes

from handsteer.recognition.hand import Hand, SignGuess
from handsteer.recognition.shipped_signs import ShippedClassifier, load_model
from handsteer.types import BACKWARD, NONE

# On a machine that is busy with other things; alone it takes a minute.
pytestmark = [pytest.mark.slow, pytest.mark.exhaustive, pytest.mark.timeout(900)]


class NeverBackward(ShippedClassifier):
    """The shipped signs, of which one was lost."""

    def classify(self, hand: Hand) -> SignGuess:
        guess = super().classify(hand)
        likelihoods = {**guess.likelihoods, BACKWARD: 0.0}
        return SignGuess(NONE, 1.0, likelihoods) if guess.sign == BACKWARD else guess


class AlwaysBackward(ShippedClassifier):
    """Reads every hand as a sign that moves the robot."""

    def classify(self, hand: Hand) -> SignGuess:
        return SignGuess(BACKWARD, 1.0, {BACKWARD: 1.0})


@pytest.fixture(scope="module")
def options(data_dir: Path) -> list[str]:
    missing = [name for name in FOLDERS if not (data_dir / name).is_dir()]
    if missing:
        pytest.skip(f"photos of people are not there: {data_dir} lacks {', '.join(missing)}")
    return ["--sample", "--jobs", "1", "--data", str(data_dir)]


def test_other_photos_than_those_of_the_table_are_refused(options: list[str], data_dir: Path, tmp_path: Path) -> None:
    for name in FOLDERS:
        (tmp_path / name).mkdir()
        for entry in (data_dir / name).iterdir():
            (tmp_path / name / entry.name).symlink_to(entry)
    index = tmp_path / "hagrid-dev" / "index.csv"
    lines = index.read_text().splitlines()
    index.unlink()
    index.write_text("\n".join(lines[:-1]))
    with pytest.raises(SystemExit, match="are not those of the table"):
        signs.main([*options, "--data", str(tmp_path), "--only", "sara / Turn Right / - / raw"])


def test_rows_that_do_not_exist_are_refused(options: list[str]) -> None:
    with pytest.raises(SystemExit, match="no row's name contains 'Sideways'"):
        signs.main([*options, "--only", "Sideways"])


def test_no_sign_is_lost_on_the_sample(options: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    signs.main(options)
    assert capsys.readouterr().out.endswith("no row is worse than the committed table\n")


def test_a_recognizer_without_backward_fails_and_only_backward_is_named(options: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        signs.main([*options, "--only", "arjav"], Eyes.open(NeverBackward(load_model())))
    lines = str(ended.value.code).splitlines()
    assert len(lines) > 2
    assert all(line.startswith("worse: ") and f" / {BACKWARD} / " in line for line in lines), lines


def test_a_recognizer_that_reads_hands_at_rest_as_a_sign_fails(options: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        signs.main([*options, "--only", "at rest"], Eyes.open(AlwaysBackward(load_model())))
    assert str(ended.value.code).startswith("worse: tune / emre / hand at rest / - / raw: ")
