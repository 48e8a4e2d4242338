import pytest

from handsteer.control.explain import Reason
from handsteer.nodes.status import RecognitionStatus, RobotStatus, Status
from handsteer.plugins.page.observed import Viewers
from handsteer.plugins.page.state import compose
from handsteer.plugins.page.study_page import without_hand
from tests.plugins.page.served import Site
from tests.plugins.page.test_state import DISARMED, NO_HAND, NO_SIGN, STOPPED, UNPLUGGED, control, observed

FORWARD = RecognitionStatus("Forward", seen="Forward", handedness="Left")
NO_FRAMES = RecognitionStatus(no_frame_s=2.0)
AT_ZERO = control(Reason("steered_at_zero"), source="steering")


def test_a_page_without_a_study_says_how_to_start_one(site: Site) -> None:
    response = site.get("/study")
    assert response.status == 200
    assert "handsteer study plan.yaml" in response.read().decode()


@pytest.mark.parametrize(
    "statuses",
    [
        (control(Reason("stop_sign", "Forward")), FORWARD),
        (control(NO_SIGN), FORWARD),
        (control(NO_SIGN), NO_HAND),
        (DISARMED, NO_HAND),
        (control(NO_SIGN), NO_FRAMES, UNPLUGGED),
        (control(Reason("no_input", "0.5"), source="none"),),
    ],
)
def test_to_one_who_steers_otherwise_the_hand_is_no_reason(statuses: tuple[Status, ...]) -> None:
    state = without_hand(compose(observed(*statuses), 0.1))
    assert (state.mood, state.headline, state.reason) == ("standing", "Standing", "nothing steers the robot")


@pytest.mark.parametrize(
    ("statuses", "viewers"),
    [
        ((control(Reason("steered"), linear=0.3, source="steering"), FORWARD), Viewers()),
        ((AT_ZERO, FORWARD), Viewers()),
        ((control(Reason("obstacle", "obstacle 0.1 m ahead"), source="steering"), FORWARD), Viewers()),
        ((control(NO_SIGN), NO_HAND, RobotStatus(trouble="is not there")), Viewers()),
        ((STOPPED, NO_HAND), Viewers(stopped="you")),
        ((control(NO_SIGN), NO_HAND), Viewers(steers="you", topic="/cmd_vel")),
        ((control(NO_SIGN), NO_HAND), Viewers(steers="you", waits=True)),
        ((), Viewers()),
    ],
)
def test_what_does_not_concern_the_hand_stays(statuses: tuple[Status, ...], viewers: Viewers) -> None:
    state = compose(observed(*statuses), 0.1, viewers)
    assert without_hand(state) == state
