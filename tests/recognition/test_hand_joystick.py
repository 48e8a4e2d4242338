"""The hand as a joystick, on hands with known shapes and places."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.config import JoystickConfig
from handsteer.recognition.hand import Hand
from handsteer.recognition.hand_joystick import HandJoystick, deflection
from handsteer.recognition.recognizer import Recognition, Recognizer
from handsteer.types import GO, RELEASED, STOP, Handedness, Stick
from tests.recognition.hands import SIZE, show_sign

DT_S = 1 / 30
OPEN, FIST = show_sign(STOP), show_sign(GO)
LINEAR = JoystickConfig(dead_zone=0.1, full_deflection=1.1, expo=0.0, min_cutoff=100.0)


def moved(hand: Hand, right_px: float, down_px: float) -> Hand:
    """Return ``hand`` elsewhere in the unmirrored picture."""
    return replace(hand, points=hand.points + np.array([right_px / SIZE[0], down_px / SIZE[1], 0], np.float32))


class Person:
    """Shows hands to a joystick, as a perfect classifier would see them."""

    def __init__(self, config: JoystickConfig = LINEAR) -> None:
        self.joystick = HandJoystick(config)

    def shows(self, hand: Hand | None, sign: str, frames: int = 1, dt_s: float = DT_S) -> Stick:
        likelihoods = {sign: 1.0} if hand is not None else {}
        for _ in range(frames):
            self.joystick.step(Recognition(sign, sign, 1.0, 1.0, hand, likelihoods), dt_s)
        return self.joystick.stick

    def opens(self, hand: Hand = OPEN, frames: int = 8) -> Stick:
        return self.shows(hand, STOP, frames)

    def closes(self, hand: Hand = FIST, frames: int = 6) -> Stick:
        return self.shows(hand, GO, frames)

    def drags(self, right_px: float, down_px: float, *, hand: Hand = FIST, frames: int = 12) -> Stick:
        """Move the fist there at an even speed."""
        for frame in range(1, frames + 1):
            share = frame / frames
            self.closes(moved(hand, share * right_px, share * down_px), 1)
        return self.joystick.stick

    def grabs(self) -> None:
        self.opens()
        assert self.closes() == Stick(held=True)

    @property
    def palm_px(self) -> float:
        assert self.joystick.grip is not None
        return self.joystick.grip.palm_px


@pytest.fixture
def person() -> Person:
    return Person()


def test_an_open_hand_that_closes_holds_it_in_the_middle(person: Person) -> None:
    assert person.opens() == RELEASED
    assert person.closes(frames=2) == RELEASED
    assert person.closes(frames=4) == Stick(held=True)


def test_a_fist_that_was_not_open_before_holds_nothing(person: Person) -> None:
    assert person.closes(frames=100) == RELEASED
    person.opens(frames=2)
    assert person.closes(frames=100) == RELEASED


def test_a_fist_long_after_the_open_hand_holds_nothing(person: Person) -> None:
    person.opens()
    person.shows(show_sign("Forward"), "Forward", 60)
    assert person.closes(frames=10) == RELEASED


@pytest.mark.parametrize(
    ("right", "down", "forward", "left"),
    [(0, -0.6, 0.5, 0), (0, 0.6, -0.5, 0), (0.6, 0, 0, 0.5), (-0.6, 0, 0, -0.5), (0.09, 0.09, 0, 0), (-1.4, 0, 0, -1)],
)
def test_its_movement_in_palm_lengths_is_the_deflection(
    person: Person, right: float, down: float, forward: float, left: float
) -> None:
    person.grabs()
    palm_px = person.palm_px
    for share in (*np.linspace(0.1, 1.0, 10), *[1.0] * 30):
        stick = person.closes(moved(FIST, share * right * palm_px, share * down * palm_px), 1)
    assert stick.held
    assert stick.forward == pytest.approx(forward, abs=0.02)
    assert stick.left == pytest.approx(left, abs=0.02)


@pytest.mark.parametrize("away_m", [0.4, 0.6, 1.2])
def test_the_distance_to_the_camera_does_not_matter(away_m: float) -> None:
    person = Person()
    hands = [show_sign(sign, away_m=away_m) for sign in (STOP, GO)]
    person.opens(hands[0])
    person.closes(hands[1])
    down_px = -0.6 * 0.09 / away_m * _focal_px()
    person.drags(0, down_px, hand=hands[1])
    stick = person.closes(moved(hands[1], 0, down_px), 20)
    assert stick.forward == pytest.approx(0.5, abs=0.1)


def _focal_px() -> float:
    return float(np.hypot(*SIZE) / (2 * np.tan(np.radians(35.0))))


@pytest.mark.parametrize("change", [{"full_deflection": 0.3}, {"dead_zone": 0.0}, {"expo": 0.3}], ids=str)
def test_a_change_of_its_parameters_lets_go(person: Person, change: dict[str, float]) -> None:
    """What is held would be another deflection at once."""
    person.grabs()
    person.joystick.reconfigure(LINEAR.model_copy())
    assert person.joystick.stick == Stick(held=True)
    person.joystick.reconfigure(LINEAR.model_copy(update=change))
    assert person.closes() == RELEASED
    person.grabs()


def test_an_open_hand_releases_it_at_once(person: Person) -> None:
    person.grabs()
    person.drags(40, 0)
    assert person.opens(moved(OPEN, 40, 0), 1) == RELEASED


def test_a_shape_that_is_no_fist_releases_it_soon(person: Person) -> None:
    person.grabs()
    assert person.shows(show_sign("Forward"), "Forward", 3).held
    assert person.shows(show_sign("Forward"), "Forward", 1) == RELEASED
    assert person.closes(frames=30) == RELEASED, "it must be opened first"


@pytest.mark.parametrize("fps", [10, 15, 30, 60])
def test_a_lost_hand_releases_it_within_a_tenth_of_a_second(person: Person, fps: int) -> None:
    person.grabs()
    frames = max(1, int(0.1 * fps + 1e-9))
    assert person.shows(None, "NONE", frames, 1 / fps) == RELEASED
    assert person.closes(frames=30) == RELEASED, "it must be opened first"


def test_one_frame_without_the_hand_changes_nothing(person: Person) -> None:
    person.grabs()
    person.drags(40, 0)
    held = person.closes(moved(FIST, 40, 0), 10)
    assert person.shows(None, "NONE") == held
    assert person.closes(moved(FIST, 40, 0), 1).left == pytest.approx(held.left, abs=1e-3)


def test_a_hand_at_the_edge_of_the_picture_releases_it(person: Person) -> None:
    person.grabs()
    for step in range(20):
        stick = person.closes(moved(FIST, 20 * step, 0), 1)
    assert stick == RELEASED


@pytest.mark.parametrize("place", [(200, 0), (0, -150)])
def test_another_hand_elsewhere_releases_it(person: Person, place: tuple[float, float]) -> None:
    person.grabs()
    assert person.closes(moved(FIST, *place), 1) == RELEASED


@pytest.mark.parametrize("away_m", [0.35, 1.1])
def test_a_much_nearer_or_farther_hand_releases_it(person: Person, away_m: float) -> None:
    person.grabs()
    assert person.closes(show_sign(GO, away_m=away_m), 1) == RELEASED


def test_the_persons_other_hand_in_its_place_releases_it(person: Person) -> None:
    person.grabs()
    assert person.closes(show_sign(GO, "Left"), 3) == RELEASED


def test_another_fist_within_reach_that_the_movement_does_not_explain_releases_it(person: Person) -> None:
    person.grabs()
    other = moved(FIST, 0.5 * person.palm_px, 0)
    assert person.closes(other, 1) == RELEASED
    assert person.closes(other, 60) == RELEASED, "it must be opened first"


@pytest.mark.parametrize("fps", [10, 12, 15, 20, 30])
@pytest.mark.parametrize("palms", [0.6, 0.7, 0.79])
def test_another_fist_takes_over_at_no_frame_rate(person: Person, fps: int, palms: float) -> None:
    person.shows(OPEN, STOP, 8, dt_s=1 / fps)
    assert person.shows(FIST, GO, 6, dt_s=1 / fps) == Stick(held=True)
    other = moved(FIST, palms * person.palm_px, 0)
    assert person.shows(other, GO, 1, dt_s=1 / fps) == RELEASED
    assert person.shows(other, GO, 60, dt_s=1 / fps) == RELEASED, "it must be opened first"


@pytest.mark.parametrize("fps", [10, 12, 15, 20, 30])
@pytest.mark.parametrize("phase", [0.0, 0.2, 0.4, 0.6, 0.8])
def test_a_fast_movement_keeps_it_at_each_frame_rate(person: Person, fps: int, phase: float) -> None:
    person.shows(OPEN, STOP, 8, dt_s=1 / fps)
    assert person.shows(FIST, GO, 6, dt_s=1 / fps) == Stick(held=True)
    palm_px = person.palm_px
    for frame in range(fps):
        share = min(1.0, (frame + phase) / fps / 0.3)
        done = share**3 * (10 - 15 * share + 6 * share**2)
        assert person.shows(moved(FIST, done * palm_px, 0), GO, 1, dt_s=1 / fps).held


def test_a_movement_of_the_whole_range_in_a_quarter_of_a_second_keeps_it(person: Person) -> None:
    person.grabs()
    palm_px = person.palm_px
    for begin, end in ((0.0, 1.1), (1.1, 0.0)):
        for frame in range(1, 9):
            u = frame / 8
            share = u**3 * (10 - 15 * u + 6 * u**2)  # of least jerk, as a person moves
            assert person.closes(moved(FIST, (begin + share * (end - begin)) * palm_px, 0), 1).held


def test_a_hand_of_another_size_in_its_place_releases_it(person: Person) -> None:
    person.grabs()
    assert person.closes(show_sign(GO, away_m=0.6 / 1.1), 1).held
    assert person.closes(show_sign(GO, away_m=0.6 / 1.1 / 1.35), 1) == RELEASED


def test_a_handedness_that_alternates_releases_it(person: Person) -> None:
    person.grabs()
    held = [person.closes(show_sign(GO, side), 1).held for _ in range(4) for side in ("Left", "Right")]
    assert held[0], "one frame may be an error"
    assert not held[-1]


def test_frames_that_are_far_apart_release_it(person: Person) -> None:
    person.grabs()
    person.shows(FIST, GO, dt_s=0.5)
    assert person.joystick.stick == RELEASED


def test_a_hand_at_rest_stays_at_rest_although_landmarks_tremble(person: Person) -> None:
    person.grabs()
    random = np.random.default_rng(0)
    for _ in range(100):
        jitter = random.normal(0, 0.01 * person.palm_px, 2)
        assert person.closes(moved(FIST, *jitter), 1) == Stick(held=True)


def test_what_is_drawn_shows_the_held_hand(person: Person) -> None:
    picture = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    person.joystick.draw(picture)
    assert not picture.any()
    person.grabs()
    person.joystick.draw(picture)
    assert picture.any()


@given(st.floats(-10, 10), st.floats(0, 0.9), st.floats(0, 1))
def test_the_response_is_odd_rises_and_stays_within_one(moved_by: float, dead_zone: float, expo: float) -> None:
    config = JoystickConfig(dead_zone=dead_zone, full_deflection=1.0, expo=expo)
    value = deflection(moved_by, config)
    assert -1 <= value <= 1
    assert value == -deflection(-moved_by, config)
    assert abs(value) <= abs(deflection(moved_by * 1.1, config)) + 1e-12
    assert value == 0 or (value > 0) == (moved_by > 0)
    assert value == 0 or abs(moved_by) > dead_zone


_SHOWN = st.tuples(
    st.sampled_from([STOP, GO, "Forward", "NONE"]),
    st.sampled_from(["Right", "Left"]),
    st.floats(-250, 250),
    st.floats(-150, 150),
    st.integers(1, 12),
    st.sampled_from([DT_S, 0.1, 0.3]),
)


@given(st.lists(_SHOWN, max_size=25))
def test_it_is_held_only_by_a_fist_in_view_that_was_open_before(
    shown: list[tuple[str, Handedness, float, float, int, float]],
) -> None:
    person = Person()
    may_hold = False
    for sign, side, right, down, frames, dt_s in shown:
        hand = None if sign == "NONE" else moved(show_sign(sign, side), right, down)
        stick = person.shows(hand, sign, frames, dt_s)
        assert abs(stick.forward) <= 1
        assert abs(stick.left) <= 1
        assert stick.held or stick == RELEASED
        may_hold = sign == STOP or (may_hold and not (sign == "NONE" and frames * dt_s > 0.21))
        if sign != GO and frames * dt_s > 0.11:
            assert not stick.held
        assert may_hold or not stick.held


CLOSED_S = {"dex-retargeting_human_hand_video_1280x720": ((8.4, 9.5), (20.1, 20.8))}
"""When a hand really closes to a fist in a recording, in seconds; in the others none does."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("step", "flipped"),
    [(1, False), *(pytest.param(*case, marks=pytest.mark.exhaustive) for case in ((1, True), (2, False), (2, True)))],
)
def test_in_recordings_of_people_it_is_held_only_while_a_fist_is_closed(
    data_dir: Path, step: int, *, flipped: bool
) -> None:
    for path in sorted((data_dir / "videos").glob("*.mp4")):
        video = cv2.VideoCapture(str(path))
        dt_s = step / video.get(cv2.CAP_PROP_FPS)
        recognizer, joystick = Recognizer(), HandJoystick()
        held_s = []
        for number, image in enumerate(frames_of(video)):
            if number % step == 0:
                picture = np.ascontiguousarray(image[:, ::-1]) if flipped else image
                if joystick.step(recognizer.step(picture, dt_s), dt_s).held:
                    held_s.append(number / step * dt_s)
        closed = CLOSED_S.get(path.stem, ())
        false = [time_s for time_s in held_s if not any(start <= time_s <= end for start, end in closed)]
        assert not false, f"{path.name}: held at {false[0]:.2f} s, {len(false)} frames"
        assert bool(held_s) == bool(closed)


def frames_of(video: cv2.VideoCapture) -> Iterator[np.ndarray]:
    while (frame := video.read())[0]:
        yield frame[1]
