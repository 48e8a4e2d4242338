from handsteer.config import ControlConfig
from handsteer.dashboard.drive_page import legend
from handsteer.types import SIGNS


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
