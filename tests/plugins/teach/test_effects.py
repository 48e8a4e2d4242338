from handsteer.config import ControlConfig
from handsteer.plugins.teach.effects import EFFECTS, effect_of
from handsteer.types import ACTIONS


def test_every_action_is_described() -> None:
    assert set(EFFECTS) == set(ACTIONS)


def test_an_effect_names_step_and_limit() -> None:
    assert effect_of("turn_left", ControlConfig()).endswith("(0.1 rad/s a frame, up to 2 rad/s)")
    assert effect_of("stop", ControlConfig()) == "stops"


def test_an_effect_is_that_of_the_rule() -> None:
    point = ControlConfig(rule="point", point_turn=0.8, max_linear=0.6)
    assert effect_of("forward", point) == ("drives where it points; raise the hand to go faster (up to 0.6 m/s)")
    assert effect_of("turn_left", point) == "turns left in place (up to 0.8 rad/s)"
    assert effect_of("go", point) == "drives straight on; keeps its speed"
