import io
import math
import pickle
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import ModelCorrupt, ModelMissing
from handsteer.plugins.virtual_hand.kinematics import angles_of
from handsteer.plugins.virtual_hand.poses import FIST, HandPose, View
from handsteer.recognition.features import COUNT
from handsteer.recognition.hand import Hand
from handsteer.recognition.shipped_signs import DEFAULT_MODEL, ShippedClassifier, load_model, save_model
from handsteer.types import BACKWARD, FORWARD, GO, MOTION_SIGNS, NONE, SIGNS, STOP, TURN_LEFT, TURN_RIGHT, Handedness
from tests.recognition.hands import SIZE, hand_of, moved, show_fingers, show_pose, show_sign

CLASSIFIER = ShippedClassifier(load_model())
THUMB_OUT = {"spread": 56.0, "opposition": 12.0}
THUMB_ACROSS = {"spread": 10.0, "opposition": 58.0, "mcp": 38.0, "ip": 45.0}


def sure_sign(hand: Hand) -> str:
    guess = CLASSIFIER.classify(hand)
    return guess.sign if guess.confidence >= 0.8 else NONE


@pytest.mark.parametrize("handedness", ["Left", "Right"])
@pytest.mark.parametrize("tilt", [-30, 0, 30])
@pytest.mark.parametrize("sign", SIGNS)
def test_signs_of_either_hand_near_and_far_and_tilted(sign: str, handedness: Handedness, tilt: float) -> None:
    # The virtual hand's thumb points 29 degrees above the horizontal in one of the turns.
    tilt = max(-20, min(20, tilt)) if sign in (TURN_LEFT, TURN_RIGHT) else tilt
    for away_m in (0.5, 1.5, 2.5):
        assert sure_sign(show_sign(sign, handedness, tilt=math.radians(tilt), away_m=away_m)) == sign


OTHERS = {
    "index sideways": show_fingers("index", roll=math.pi / 2),
    "index to the other side": show_fingers("index", roll=-math.pi / 2),
    "thumb up": show_fingers(thumb=THUMB_OUT, roll=math.radians(-65)),
    "thumb down": show_fingers(thumb=THUMB_OUT, roll=math.radians(115)),
    "peace": show_fingers("index", "middle"),
    "three": show_fingers("index", "middle", "ring"),
    "three with the thumb": show_fingers("index", "middle", thumb=THUMB_OUT),
    "four": show_fingers("index", "middle", "ring", "little", thumb=THUMB_ACROSS),
    "L": show_fingers("index", thumb=THUMB_OUT),
    "horns": show_fingers("index", "little"),
    "call": show_fingers("little", thumb=THUMB_OUT),
    "little finger": show_fingers("little"),
    "middle finger": show_fingers("middle"),
    "OK": show_fingers(
        "middle",
        "ring",
        "little",
        thumb={"spread": 28.0, "opposition": 45.0, "mcp": 5.0, "ip": 20.0},
        bend={"index_mcp": 50.0, "index_pip": 60.0, "index_dip": 35.0},
    ),
    "half open": show_fingers(
        thumb={"spread": 30.0, "opposition": 30.0, "mcp": 10.0, "ip": 15.0},
        bend={f"{f}_{j}": a for f in ("index", "middle", "ring", "little") for j, a in (("mcp", 30.0), ("pip", 45.0))},
    ),
    "an open hand that hangs": show_fingers("index", "middle", "ring", "little", thumb=THUMB_OUT, roll=math.pi),
}


@pytest.mark.parametrize("name", OTHERS)
def test_other_hands_are_none(name: str) -> None:
    assert sure_sign(OTHERS[name]) == NONE


@pytest.mark.parametrize("view", ["front", "back", "side", "other side", "from below"])
@pytest.mark.parametrize("thumb", ["over the fingers", "along them"])
def test_fists_from_all_sides_never_turn_the_robot(view: str, thumb: str) -> None:
    yaw = {"back": math.pi, "side": math.pi / 2, "other side": -math.pi / 2}.get(view, 0.2)
    pitch = -0.7 if view == "from below" else 0.0
    along = {"spread": 18.0, "opposition": 14.0, "mcp": 6.0, "ip": 10.0}
    angles = angles_of(**{f"thumb_{joint}": angle for joint, angle in along.items()})
    angles[7:] = FIST[7:]
    pose = HandPose(FIST if thumb == "over the fingers" else angles, View(yaw=yaw, pitch=pitch))
    assert sure_sign(show_pose(pose)) in (GO, NONE)


@pytest.mark.parametrize("tilt", [-15, 0, 15])
@pytest.mark.parametrize("up", [True, False])
def test_a_thumb_up_or_down_is_no_turn_when_it_is_tilted(tilt: float, up: bool) -> None:
    # A thumb stretched out like this one points up when the hand is rolled by -65 degrees.
    roll = math.radians((-65 if up else 115) + tilt)
    assert sure_sign(show_fingers(thumb=THUMB_OUT, roll=roll)) == NONE


def test_a_hand_at_the_edge_of_the_frame_is_less_sure() -> None:
    hand = show_sign(STOP)
    cut = moved(hand, x_px=SIZE[0] / 2)
    assert CLASSIFIER.classify(cut).likelihoods[STOP] < 0.7 * CLASSIFIER.classify(hand).likelihoods[STOP]


def test_a_motion_must_be_likelier_than_go_and_stop_to_be_as_sure() -> None:
    assert CLASSIFIER.confidence(GO, 0.62) > 0.8
    assert CLASSIFIER.confidence(STOP, 0.62) > 0.8
    assert all(CLASSIFIER.confidence(sign, 0.62) < 0.8 for sign in MOTION_SIGNS)
    assert all(CLASSIFIER.confidence(sign, 1.0) == 1.0 for sign in SIGNS)


@pytest.mark.parametrize("sign", SIGNS)
def test_the_mirror_image_is_as_sure_and_turns_the_other_way(sign: str) -> None:
    hand = show_sign(sign)
    flipped = hand_of(
        np.array([SIZE[0], 0]) + hand.pixels[:, :2] * np.array([-1, 1]), hand.world * np.array([-1, 1, 1]), "Left"
    )
    one, other = CLASSIFIER.classify(hand), CLASSIFIER.classify(flipped)
    assert other.sign == {TURN_LEFT: TURN_RIGHT, TURN_RIGHT: TURN_LEFT}.get(one.sign, one.sign)
    assert other.confidence == pytest.approx(one.confidence, abs=1e-4)


def pointing_down(bend_deg: float, thumb: dict[str, float], *, back: bool, pitch_deg: float = 0.0) -> Hand:
    """Return a hand whose index finger points down, bent at its knuckle, and shows its palm or its back."""
    degrees = {f"thumb_{joint}": angle for joint, angle in thumb.items()}
    degrees |= {"index_mcp": bend_deg, "index_pip": 6.0, "index_dip": 4.0}
    for finger in ("middle", "ring", "little"):
        degrees |= {f"{finger}_mcp": 78.0, f"{finger}_pip": 92.0, f"{finger}_dip": 50.0}
    # Bent, the finger points to the palm's side, so the hand is tipped to let it point down.
    tipped = math.radians(pitch_deg - 0.7 * bend_deg if back else pitch_deg + 0.7 * bend_deg)
    yaw = math.pi if back else 0.0
    return show_pose(HandPose(angles_of(**degrees), View(yaw=yaw + 0.1, pitch=tipped, roll=math.pi)))


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("pitch_deg", [-20, 0, 20])
@pytest.mark.parametrize("thumb", [THUMB_ACROSS, THUMB_OUT])
def test_backward_from_the_palm_and_the_back_with_the_thumb_in_or_out(
    back: bool, pitch_deg: float, thumb: dict[str, float]
) -> None:
    assert sure_sign(pointing_down(5.0, thumb, back=back, pitch_deg=pitch_deg)) == BACKWARD


@pytest.mark.parametrize("thumb", [THUMB_ACROSS, THUMB_OUT])
@pytest.mark.parametrize("bend_deg", [25, 45, 60])
def test_an_index_finger_bent_at_its_knuckle_points_down_from_the_back(
    thumb: dict[str, float], bend_deg: float
) -> None:
    assert sure_sign(pointing_down(bend_deg, thumb, back=True)) == BACKWARD


def test_a_hand_that_is_hardly_there_is_no_sign() -> None:
    assert CLASSIFIER.classify(replace(show_sign(STOP), presence=0.4)).sign == NONE


def test_a_hand_of_a_few_pixels_is_no_sign() -> None:
    assert CLASSIFIER.classify(show_sign(GO, away_m=3.0)).sign == GO
    assert CLASSIFIER.classify(show_sign(GO, away_m=8.0)).sign == NONE


def test_points_that_are_no_hand_are_no_sign() -> None:
    random = np.random.default_rng(0)
    signs = []
    for _ in range(200):
        world = random.normal(0, 0.05, (21, 3))
        signs.append(CLASSIFIER.classify(hand_of(world[:, :2] * 900 + 300, world)).sign)
    assert signs.count(NONE) >= 198


@given(st.lists(st.floats(-10, 10, width=32), min_size=126, max_size=126), st.floats(0, 1))
def test_any_landmarks_give_a_known_sign_and_a_confidence(values: list[float], presence: float) -> None:
    numbers = np.array(values, np.float32).reshape(2, 21, 3)
    guess = CLASSIFIER.classify(Hand(numbers[0], numbers[1], "Left", 0.5, presence, SIZE))
    assert 0.0 <= guess.confidence <= 1.0
    assert guess.sign in (*SIGNS, NONE)


def test_collapsed_landmarks_are_no_sign() -> None:
    nothing = np.zeros((21, 3), np.float32)
    assert CLASSIFIER.classify(Hand(nothing, nothing, "Left", 0.5, 1.0, SIZE)).sign == NONE


@pytest.mark.parametrize("roll", [-90, -75, -35, 0, 35, 75, 90])
def test_forward_is_an_index_finger_that_points_up_more_than_sideways(roll: int) -> None:
    expected = FORWARD if abs(roll) <= 35 else NONE
    assert sure_sign(show_fingers("index", roll=math.radians(roll))) == expected


CONTENT = DEFAULT_MODEL.read_bytes()


def changed(path: Path, **arrays: np.ndarray | None) -> Path:
    """Write the shipped model with some arrays replaced, or left out where None."""
    with np.load(DEFAULT_MODEL) as file:
        content = {name: file[name] for name in file.files}
    content |= {name: array for name, array in arrays.items() if array is not None}
    for name in [name for name, array in arrays.items() if array is None]:
        del content[name]
    np.savez(path, **content)
    return path


def test_the_shipped_model_is_small_and_says_what_it_was_trained_on() -> None:
    model = load_model()
    assert len(CONTENT) < 300_000
    assert model.shapes == ("open", "index", "index_down", "thumb", "fist", "other")
    assert "synthetic hands" in model.trained_on["source"]
    assert sum(model.trained_on["hands"].values()) > 100_000


def test_what_is_saved_is_loaded_and_gives_the_same_bytes(tmp_path: Path) -> None:
    save_model(load_model(), tmp_path / "copy.npz")
    assert (tmp_path / "copy.npz").read_bytes() == CONTENT
    features = np.random.default_rng(0).uniform(0, 2, COUNT)
    assert load_model(tmp_path / "copy.npz").probabilities(features) == load_model().probabilities(features)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ModelMissing, match=r"none\.npz"):
        load_model(tmp_path / "none.npz")


@pytest.mark.parametrize("content", [b"", b"hello", CONTENT[:-1000], CONTENT[:5000], pickle.dumps({"a": 1})])
def test_what_is_no_model_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "bad.npz").write_bytes(content)
    with pytest.raises(ModelCorrupt, match=r"bad\.npz"):
        load_model(tmp_path / "bad.npz")


def test_nothing_in_a_file_is_run(tmp_path: Path) -> None:
    class Bomb:
        def __reduce__(self) -> tuple[object, ...]:
            return (Path.touch, (tmp_path / "exploded",))

    np.savez(tmp_path / "bomb.npz", format=np.array([Bomb()], dtype=object))
    with pytest.raises(ModelCorrupt):
        load_model(tmp_path / "bomb.npz")
    assert not (tmp_path / "exploded").exists()


def test_another_version_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(ModelCorrupt, match="a sign model of format 99 is not known, expected 1"):
        load_model(changed(tmp_path / "new.npz", format=np.array(99)))


@pytest.mark.parametrize(
    "arrays",
    [
        {"weights_0": None},
        {"shapes": None},
        {"trained_on": np.array("{")},
        {"trained_on": np.array("[1, 2]")},
        {"mean": np.zeros(3, np.float32)},
        {"biases_1": np.zeros(7, np.float32)},
        {"limit": np.array(np.nan)},
        {"limit": np.array([1.0, 2.0])},
        {"scale": np.full(COUNT, np.inf, np.float32)},
        {"shapes": np.array(["open", "open", "thumb", "fist", "other"])},
        {"shapes": np.array(["open", "index", "thumb", "fist", "none"])},
        {"whitening": np.array(["a", "b"])},
    ],
    ids=lambda arrays: str(next(iter(arrays))),
)
def test_a_model_whose_parts_do_not_fit_is_refused(tmp_path: Path, arrays: dict[str, np.ndarray | None]) -> None:
    with pytest.raises(ModelCorrupt, match=r"odd\.npz"):
        load_model(changed(tmp_path / "odd.npz", **arrays))


@given(st.integers(0, len(CONTENT) - 1), st.integers(1, 255))
def test_a_flipped_byte_is_refused_or_makes_no_difference_to_loading(
    tmp_path_factory: pytest.TempPathFactory, place: int, flip: int
) -> None:
    damaged = bytearray(CONTENT)
    damaged[place] ^= flip
    path = tmp_path_factory.mktemp("models") / "flipped.npz"
    path.write_bytes(bytes(damaged))
    try:
        model = load_model(path)
    except (ModelCorrupt, ModelMissing):
        return
    assert model.network.mean.shape == (COUNT,)


def test_no_array_of_the_shipped_model_is_an_object() -> None:
    with zipfile.ZipFile(io.BytesIO(CONTENT)) as file:
        headers = [file.read(name)[:128] for name in file.namelist()]
    assert all(b"|O" not in header for header in headers)
