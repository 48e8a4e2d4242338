"""Learning takes seconds, so what one training shows is looked at from several sides."""

from collections.abc import Sequence

import numpy as np
import pytest

from handsteer.errors import TrainingError
from handsteer.plugins.teach.dataset import Dataset, Take, typical_hand
from handsteer.plugins.teach.report import TrainingReport
from handsteer.plugins.teach.train import train_signs
from handsteer.recognition.custom_signs import CustomClassifier, CustomModel
from handsteer.recognition.hand import Hand
from handsteer.recognition.shipped_signs import ShippedClassifier, load_model
from handsteer.types import NONE, SIGNS
from tests.plugins.teach.takes import other_hand, shaken, take, takes

SHIPPED = ShippedClassifier(load_model())
Learnt = tuple[CustomModel, TrainingReport, list[int]]


def told(classifier: CustomClassifier, hands: Sequence[Hand]) -> list[str]:
    guesses = [classifier.classify(hand) for hand in hands]
    return [guess.sign if guess.confidence >= 0.8 else NONE for guess in guesses]


def shown(pose: str, count: int = 60, tilt: float = 0.0) -> list[Hand]:
    random = np.random.default_rng(99)
    return [shaken(pose, random, tilt=tilt) for _ in range(count)]


@pytest.fixture(scope="module")
def learnt() -> Learnt:
    """Peace and Call, from five takes of three seconds of one person."""
    steps: list[int] = []
    data = Dataset((*takes("Peace"), *takes("Call", seed=20), *takes(NONE, "Three", count=2, seed=40)))
    model, report = train_signs(data, SHIPPED, progress=lambda done, of: steps.append(of - done))
    return model, report, steps


@pytest.mark.slow
def test_five_takes_are_enough_for_a_new_sign(learnt: Learnt) -> None:
    model, report, _ = learnt
    classifier = CustomClassifier(SHIPPED, model)
    assert classifier.signs == (*SIGNS, "Peace", "Call")
    for sign in ("Peace", "Call"):
        assert told(classifier, shown(sign)).count(sign) >= 0.95 * 60
        assert told(classifier, [other_hand(hand) for hand in shown(sign)]).count(sign) >= 0.95 * 60
        assert told(classifier, shown(sign, tilt=0.4)).count(sign) >= 0.95 * 60
    assert report.held_out == "take"
    assert all(sign.recall is not None and (sign.recall.rate or 0) >= 0.95 for sign in report.signs)


@pytest.mark.slow
def test_the_other_signs_are_told_as_before(learnt: Learnt) -> None:
    classifier = CustomClassifier(SHIPPED, learnt[0])
    for sign in SIGNS:
        for hand in shown(sign, 30):
            before, after = SHIPPED.classify(hand), classifier.classify(hand)
            assert before.confidence < 0.8 or after == before
    for pose in ("Three", "Four", "Horns", "OK"):
        assert set(told(classifier, shown(pose, 30))) == {NONE}
    assert set(told(classifier, shown("Call", tilt=np.pi))) == {NONE}


@pytest.mark.slow
def test_it_says_how_far_it_is_and_what_was_learnt_from(learnt: Learnt) -> None:
    model, report, steps = learnt
    assert steps == list(range(len(steps) - 1, -1, -1))
    facts = {sign["label"]: sign for sign in model.trained_on["signs"]}
    assert facts["Peace"]["takes"] == 5
    assert facts[NONE]["rows"] == 180
    assert model.trained_on["persons"] == 1
    assert report.as_dict()["confusion"]["labels"] == ("Peace", "Call", NONE)
    assert report.made.rate is not None
    assert report.made.rate < 0.002


@pytest.mark.slow
def test_real_photos_give_what_they_gave_before(learnt: Learnt, real_hands: list[tuple[str, Hand]]) -> None:
    classifier = CustomClassifier(SHIPPED, learnt[0])
    for truth, hand in real_hands:
        before, after = SHIPPED.classify(hand), classifier.classify(hand)
        if truth != NONE and before.confidence >= 0.8:
            assert after == before


@pytest.mark.slow
def test_landmarks_without_depth_are_learnt_from_the_image_and_sides_are_kept() -> None:
    def flat(label: str, seed: int, *, left: bool) -> Take:
        solid = take(label, "Forward", seed=seed, tilt=-np.pi / 2 if left else np.pi / 2)
        unknown = np.full((21, 3), np.nan, np.float32)
        hands = tuple(Hand(hand.points, unknown, "Right", 0.5, 1.0, hand.image_size) for hand in solid.hands)
        return Take(label, "me", "today", "csv", hands, solid.times_s)

    data = Dataset(
        (
            *(flat("Point Left", seed, left=True) for seed in (1, 2)),
            *(flat("Point Right", seed, left=False) for seed in (3, 4)),
        )
    )
    model, report = train_signs(data, SHIPPED)
    assert all(sign.sided for sign in report.signs)
    assert model.depth == "flat"
    assert all(sign.recall and sign.recall.rate == 1.0 for sign in report.signs)
    classifier = CustomClassifier(SHIPPED, model)
    assert told(classifier, shown("Forward", 40, tilt=np.pi / 2)).count("Point Right") >= 38
    other_hands = [other_hand(hand) for hand in shown("Forward", 40, tilt=np.pi / 2)]
    assert "Point Right" not in told(classifier, other_hands)
    assert set(told(classifier, shown("Forward", 40))) == {"Forward"}


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (Dataset(), "there is no new sign to learn, only nothing at all"),
        (Dataset((take(NONE, "Go"), take("Stop"))), "there is no new sign to learn, only NONE, Stop"),
        (Dataset((take("Hi", "Peace"),)), "too little data for Hi: 1 take with 90 hands; at least 2 takes"),
        (
            Dataset((take("Hi", "Peace", hands=4), take("Hi", "Peace", hands=4))),
            "too little data for Hi: 2 takes with 8 hands; at least 2 takes with 10 hands",
        ),
        (Dataset((*takes("Hi", "Peace", count=2), *takes("hi", "Call", count=2))), "'Hi' and 'hi' mean the same"),
        (
            Dataset((take("Caf\u00e9", "Peace", hands=2), take("Cafe\u0301", "Call", hands=2))),
            "'Caf\u00e9' and 'Cafe\u0301' mean the same",
        ),
        (
            Dataset((take("\uff33\uff54\uff4f\uff50", "Peace", hands=2),)),
            "'Stop' and '\uff33\uff54\uff4f\uff50' mean the same",
        ),
        (Dataset(tuple(takes("Hi", "Stop", count=2))), r"Hi looks like Stop: \d+% of its hands are recognised as that"),
    ],
    ids=["nothing", "no new one", "one take", "few hands", "same name", "accents", "full width", "shipped"],
)
def test_what_cannot_be_learnt_is_refused_with_a_reason(data: Dataset, message: str) -> None:
    with pytest.raises(TrainingError, match=message):
        train_signs(data, SHIPPED)


def test_a_side_of_a_sign_that_is_not_there_is_refused() -> None:
    with pytest.raises(TrainingError, match="--sided: there is no sign 'Ho' to learn; there are Hi"):
        train_signs(Dataset(tuple(takes("Hi", "Peace", count=2))), SHIPPED, sided=["Ho"])


@pytest.mark.slow
def test_what_can_be_learnt_is_learnt_and_the_rest_is_left_out_with_a_reason() -> None:
    data = Dataset(
        (
            *takes("Hi", "Peace", count=3),
            *takes("Ho", "Peace", count=3, seed=9),
            *takes("Call", count=3, seed=20),
            *takes("Wave", "Stop", count=2, seed=30),
            take("Once", "Three"),
            *takes("Old", "Four", count=2, seed=40),
        ),
        frozenset({"Old"}),
    )
    model, report = train_signs(data, SHIPPED)
    left = {each.label: each.why for each in report.left_out}
    assert set(model.labels) | set(left) == {"Hi", "Ho", "Call", "Wave", "Once", "Old"}
    assert len({"Hi", "Ho"} & set(model.labels)) == 1
    assert left["Old"] == "Old is disabled"
    assert "looks like Stop" in left["Wave"]
    assert left["Once"].startswith("too little data for Once: 1 take")
    assert any(each.startswith(("Hi looks like Ho", "Ho looks like Hi")) for each in left.values())
    assert report.as_dict()["left_out"] == left
    classifier = CustomClassifier(SHIPPED, model)
    assert told(classifier, shown("Call", 40)).count("Call") >= 38


@pytest.mark.slow
def test_takes_with_hands_that_are_not_recognised_are_named(learnt: Learnt) -> None:
    wrong = take("Call", "Peace", hands=30, seed=70)
    data = Dataset((*takes("Peace"), *takes("Call", seed=20), wrong))
    _, report = train_signs(data, SHIPPED)
    worst = report.mistakes[0]
    assert (worst.take, worst.shown) == (10, "Call")
    assert worst.seen in ("Peace", NONE)
    assert 0 <= worst.hand < 30
    assert worst.hands.of == 30, "a hand that was mistaken as it is and mirrored counts once"
    assert 15 < worst.hands.count <= 30
    assert all(each.hands.count <= 0.2 * each.hands.of for each in learnt[1].mistakes)


def test_the_typical_hand_is_none_of_the_odd_ones() -> None:
    random = np.random.default_rng(5)
    hands = [shaken("Peace", random) for _ in range(9)]
    assert typical_hand([shaken("Stop", random), *hands, shaken("Go", random)]) in range(1, 10)
    mixed = [hands[0], *(other_hand(hand) for hand in hands[1:])]
    assert typical_hand(mixed) == typical_hand(hands)
