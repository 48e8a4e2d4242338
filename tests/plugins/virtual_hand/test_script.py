import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.errors import PoseError
from handsteer.plugins.virtual_hand.kinematics import LIMITS, pose_joints
from handsteer.plugins.virtual_hand.poses import Pinhole, sign_pose
from handsteer.plugins.virtual_hand.script import Motion, Part, parse_script
from handsteer.types import NONE, SIGNS, Handedness

SCRIPT = "Forward:1 Turn Left:1 Stop:0.5 Backward:1 Turn Right:1 Go:0.7 NONE:1"
PARTS = st.lists(st.tuples(st.sampled_from([*SIGNS, NONE]), st.floats(0.01, 100)), min_size=1, max_size=8)
HANDS: tuple[Handedness, ...] = ("Left", "Right")


def joints_m(motion: Motion, handedness: Handedness, time_s: float) -> np.ndarray:
    pose = motion.at(time_s).pose
    return pose.view.placement(handedness).apply(pose_joints(pose.angles)[0])


@given(PARTS)
def test_a_script_is_read_as_it_is_written(parts: list[tuple[str, float]]) -> None:
    text = " ".join(f"{sign}:{seconds}" for sign, seconds in parts)
    assert parse_script(text) == tuple(Part(sign, seconds) for sign, seconds in parts)


def test_space_between_parts_does_not_matter() -> None:
    assert parse_script("  Turn Left:2   Go:1.5 ") == (Part("Turn Left", 2.0), Part("Go", 1.5))


@pytest.mark.parametrize(
    ("script", "complaint"),
    [
        ("", "empty"),
        ("   ", "empty"),
        ("Forward", "part 1, 'Forward': no duration"),
        ("Forward:3 Stop", "part 2, 'Stop': no duration"),
        ("Forward:3 Turn:2 Stop:1", "part 2, 'Turn:2': unknown sign 'Turn'"),
        ("forward:3", "unknown sign 'forward'.*Forward"),
        ("Go:x", "part 1, 'Go:x': 'x' is not a valid duration"),
        ("Go:", "part 1, 'Go:': '' is not a valid duration"),
        ("Go:1 Stop:0", "part 2, 'Stop:0'"),
        ("Go:-1", "'-1' is not a valid duration"),
        ("Go:nan", "'nan' is not a valid duration"),
        ("Go:inf", "'inf' is not a valid duration"),
        ("Go:1e9", "'1e9' is not a valid duration"),
        (":3", "unknown sign ''"),
        ("Go@:1", "part 1, 'Go@:1': '' is not a valid place.*Go@0.1,-0.05:2"),
        ("Go@0.1:1", "'0.1' is not a valid place"),
        ("Go@0.1,0,0:1", "'0.1,0,0' is not a valid place"),
        ("Go@0.1,nan:1", "'0.1,nan' is not a valid place"),
        ("Go:1 Go@0.6,0:1", "part 2, 'Go@0.6,0:1': '0.6,0' is not a valid place"),
        ("Go@0.1,0:x", "'x' is not a valid duration"),
    ],
)
def test_a_wrong_script_is_refused_with_its_place(script: str, complaint: str) -> None:
    with pytest.raises(PoseError, match=complaint) as caught:
        parse_script(script)
    assert "\n" not in str(caught.value)


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_a_place_is_read_as_it_is_written(right_m: float, down_m: float) -> None:
    assert parse_script(f"Stop:1 Turn Left@{right_m},{down_m}:2")[1] == Part("Turn Left", 2.0, right_m, down_m)


@pytest.mark.parametrize("hand", HANDS)
def test_a_place_moves_either_hand_to_the_persons_right_and_down(hand: Handedness) -> None:
    usual, moved = (joints_m(Motion(script, hand), hand, 0.9) for script in ("Go:5", "Go@0.1,-0.05:5"))
    # The camera looks at the person: its right is the person's left.
    np.testing.assert_allclose(moved - usual, np.broadcast_to([-0.1, -0.05, 0.0], moved.shape), atol=1e-12)


@pytest.mark.parametrize("hand", HANDS)
def test_the_motion_is_smooth_also_where_the_script_starts_again(hand: Handedness) -> None:
    motion = Motion(SCRIPT, hand)
    times = np.arange(0, 2 * motion.duration_s, 1 / 500)
    joints = np.array([joints_m(motion, hand, time) for time in times])
    speed_mps = np.linalg.norm(np.diff(joints, axis=0), axis=-1) * 500
    # Fastest is the way out of the picture, 0.6 m in 0.3 s, eased; a jump of 1 cm would count as 5 m/s.
    assert speed_mps.max() < 4.5


@pytest.mark.parametrize("hand", HANDS)
@pytest.mark.parametrize("sign", SIGNS)
def test_a_sign_is_held_with_a_small_sway(sign: str, hand: Handedness) -> None:
    motion = Motion(f"{sign}:5", hand)
    held = np.array([joints_m(motion, hand, time) for time in np.arange(0.5, 4.9, 0.1)])
    pose = sign_pose(sign, hand)
    meant = pose.view.placement(hand).apply(pose_joints(pose.angles)[0])
    off = np.linalg.norm(held - meant, axis=-1)
    assert off.max() < 0.02
    assert np.ptp(off) > 0.001


@given(st.floats(0, 1e5), st.integers(0, 5))
def test_the_same_script_seed_and_time_give_the_same_hand(time_s: float, seed: int) -> None:
    first, second = (Motion(SCRIPT, "Right", seed).at(time_s) for _ in range(2))
    np.testing.assert_array_equal(first.pose.angles, second.pose.angles)
    assert first.pose.view == second.pose.view
    assert (first.sign, first.settled) == (second.sign, second.settled)


def test_another_seed_sways_otherwise() -> None:
    first, second = (Motion("Stop:5", "Right", seed).at(2.0).pose for seed in (0, 1))
    assert not np.array_equal(first.angles, second.angles)


@given(st.floats(0, 1e4))
def test_the_angles_stay_within_the_limits(time_s: float) -> None:
    angles = Motion(SCRIPT).at(time_s).pose.angles
    assert np.all((angles >= LIMITS[:, 0]) & (angles <= LIMITS[:, 1]))


def test_signs_come_in_order_settle_and_start_again() -> None:
    motion = Motion("Forward:1 Turn Left:2 NONE:1")
    shown = [motion.at(time) for time in (0.1, 0.9, 1.1, 2.9, 3.9, 4.9)]
    assert [moment.sign for moment in shown] == ["Forward", "Forward", "Turn Left", "Turn Left", "NONE", "Forward"]
    assert [moment.settled for moment in shown] == [False, True, False, True, True, True]


@pytest.mark.parametrize("size", [(640, 480), (480, 640), (64, 4096)])
def test_none_lowers_the_hand_out_of_the_picture(size: tuple[int, int]) -> None:
    camera = Pinhole.webcam(*size)
    motion = Motion("Stop:1 NONE:2")
    assert np.all(camera.project(joints_m(motion, "Right", 2.0))[:, 1] > size[1] + 10)
