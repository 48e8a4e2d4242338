from handsteer.config import ControlConfig
from handsteer.nodes.status import ControlStatus, RecognitionStatus, Status
from handsteer.plugins.page.legend import active_entry, bars_of, joystick_legend, legend
from handsteer.plugins.page.observed import Observed, Report
from handsteer.plugins.page.state import PageState, compose
from handsteer.types import SIGNS, Velocity


def effects(signs: tuple[str, ...], rule: ControlConfig | None) -> dict[str, tuple[str, str]]:
    return {entry.sign: (entry.effect, entry.figures) for entry in legend(signs, rule)}


def test_shipped_signs_come_first_and_say_their_steps_and_limits() -> None:
    entries = legend(("Peace", *SIGNS), ControlConfig(max_linear=0.5))
    assert [entry.sign for entry in entries] == [
        "Forward",
        "Backward",
        "Stop",
        "Turn Left",
        "Turn Right",
        "Go",
        "Peace",
    ]
    assert (entries[0].effect, entries[0].figures) == ("faster forward", "0.01 m/s a frame, up to 0.5 m/s")
    assert (entries[3].effect, entries[3].figures) == ("turns faster to the left", "0.1 rad/s a frame, up to 2 rad/s")
    assert (entries[-1].pose, entries[-1].effect) == ("taught", "goes on as it does")
    assert all(entry.drawing.startswith("<svg") and entry.pose for entry in entries)


def test_remapped_signs_say_what_they_really_do() -> None:
    rule = ControlConfig(actions={"forward": "stop", "Peace": "turbo"}, ramp="per_second")
    said = effects((*SIGNS, "Peace"), rule)
    assert said["Forward"] == ("stops", "")
    assert said["Peace"] == ("twice as fast while shown, within the limits", "up to 1 m/s")
    assert said["Backward"] == ("slower, then backward", "0.3 m/s a second, up to 1 m/s")


def test_says_what_is_built_in_while_nothing_is_known() -> None:
    assert effects(SIGNS, None)["Turn Right"] == ("turns faster to the right", "")


def state(control: ControlStatus, sign: str, linear_mps: float = 0.0) -> PageState:
    recognition = RecognitionStatus(sign, seen=sign, handedness="Right")
    reports: dict[type[Status], Report] = {type(each): Report(each, 0.0) for each in (control, recognition)}
    return compose(Observed(reports, command=Velocity(linear_mps, 0.0), command_came_s=0.0), 0.1)


def test_the_joystick_is_explained_in_three_steps_with_its_speeds() -> None:
    rule = ControlConfig(mode="joystick", max_linear=0.4, max_angular=1.5)
    steps = joystick_legend(rule)
    assert [step.sign for step in steps] == ["Open the hand", "Close the fist", "Move it"]
    assert steps[2].figures == "up to 0.4 m/s and 1.5 rad/s"
    assert all(step.drawing.startswith("<svg") and step.effect for step in steps)

    held = ControlStatus(source="joystick", rule=rule)
    assert active_entry(state(held, "Stop")) == "Open the hand"
    assert active_entry(state(held, "Go")) == "Close the fist"
    assert active_entry(state(held, "Go", 0.1)) == "Move it"
    assert active_entry(state(held, "Forward")) == ""
    steered = ControlStatus(source="steering", rule=rule)
    assert active_entry(state(steered, "Go", 0.1)) == "Close the fist"
    assert active_entry(state(ControlStatus(source="signs", rule=ControlConfig()), "Go", 0.1)) == "Go"


def test_a_taught_sign_has_its_own_drawing() -> None:
    peace, call = legend(("Peace", "Call"), None, {"Peace": "<svg>peace</svg>"})
    assert (peace.pose, peace.drawing) == ("taught", "<svg>peace</svg>")
    assert call.drawing.startswith("<svg")


def test_each_sign_has_a_bar_and_the_threshold_its_place() -> None:
    def bars(status: RecognitionStatus) -> tuple[tuple[int, ...], int]:
        return bars_of(compose(Observed({RecognitionStatus: Report(status, 0.0)}), 0.1))

    signs = ("Go", "Peace")
    seen = RecognitionStatus(signs=signs, confidences=(0.031, 0.97), min_confidence=0.7)
    assert bars(seen) == ((4, 96), 70)
    assert bars(RecognitionStatus(signs=signs)) == ((0, 0), 80), "no hand, and what is built in"
    assert bars(RecognitionStatus(signs=signs, confidences=(7.0, -1.0, 0.5))) == ((100, 0), 80)
