from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.clock import SteppedClock
from handsteer.config import Config, load
from handsteer.config.driving import PRESETS
from handsteer.errors import ConfigError
from handsteer.graph import Graph
from handsteer.messages import CMD_VEL, HAND_SIGN, String
from handsteer.plugins.page.settings import Settings, SettingsFile, changed, defaults, loaded
from handsteer.plugins.page.settings_fields import FIELDS, FORM


class Bench:
    """Settings of nodes that only note what they are given."""

    def __init__(self, folder: Path, given: dict[str, Any] | None = None, text: str | None = None) -> None:
        self.path = folder / "my.yaml"
        if text is not None:
            self.path.write_text(text)
        self.running = load(self.path if text is not None else None, None, given or {})
        self.applied: list[Config] = []
        self.settings = Settings(lambda: self.running, self._apply, SettingsFile(self.path, is_read=text is not None))

    def _apply(self, config: Config) -> None:
        self.running = config
        self.applied.append(config)

    def set(self, path: str, text: str) -> None:
        self.settings.set(FIELDS[path], text)

    def shown(self, path: str) -> object:
        return FIELDS[path].value_in(self.settings.wanted)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


def test_what_is_live_is_applied_at_once_and_the_rest_waits_for_the_next_start(bench: Bench) -> None:
    bench.set("control.max_linear", "0.4")
    assert bench.running.control.max_linear == 0.4
    bench.set("camera.fps", "15")
    assert bench.running.camera.fps == 30
    assert len(bench.applied) == 1
    assert bench.settings.waits(FIELDS["camera.fps"])
    assert not bench.settings.waits(FIELDS["control.max_linear"])
    assert [path for path, field in FIELDS.items() if bench.settings.is_changed(field)] == [
        "camera.fps",
        "control.max_linear",
    ]
    bench.settings.reset(*FIELDS.values())
    assert bench.settings.wanted == bench.running == Config()


@pytest.mark.parametrize(
    ("path", "text", "said"),
    [
        ("control.max_linear", "11", r"^control.max_linear: 11 should be less than or equal to 10$"),
        ("dashboard.private_key", "key.pem", r"^dashboard.private_key: is of no use without dashboard.certificate"),
        ("control.robots", "r1, r2", r"^control.robots: is for `handsteer control`"),
        ("virtual_hand.script", "Forward", r"^virtual_hand.script: "),
        ("robot.world", "nowhere", r"^robot.world: "),
        ("control.actions", "Stop: go", r"^control.actions: .* should leave Stop at 'stop'"),
    ],
)
def test_what_the_next_start_would_refuse_is_refused_and_changes_nothing(
    bench: Bench, path: str, text: str, said: str
) -> None:
    before = bench.settings.revision
    with pytest.raises(ConfigError, match=said):
        bench.set(path, text)
    assert bench.settings.wanted == bench.running == Config()
    assert bench.settings.revision == before


def test_both_ends_of_cmd_vel_are_checked_together(tmp_path: Path) -> None:
    bench = Bench(tmp_path, {"robot": {"kind": "dds", "preset": "turtlebot4", "cmd_vel_type": "twist"}})
    with pytest.raises(ConfigError, match="should be the same"):
        bench.set("control.cmd_vel_type", "twist_stamped")


def test_another_robot_brings_its_own_defaults_at_the_next_start_only(bench: Bench) -> None:
    bench.set("control.max_angular", "1.5")
    bench.set("robot.preset", "turtlesim")
    assert (bench.shown("control.max_linear"), bench.running.control.max_linear) == (2.0, 1.0)
    assert bench.settings.waits(FIELDS["control.max_linear"])
    assert not bench.settings.is_changed(FIELDS["control.max_linear"])
    assert bench.shown("control.max_angular") == 1.5
    bench.settings.reset(FIELDS["control.max_linear"])
    assert bench.running.control.max_linear == 1.0  # no reset makes the robot that runs faster than its own limits
    bench.set("control.max_linear", "1.8")
    assert bench.running.control.max_linear == 1.8


def test_what_a_node_cannot_take_changes_nothing(bench: Bench) -> None:
    def refuse(_config: Config) -> None:
        raise ConfigError("signs.model: no such file")

    settings = Settings(lambda: bench.running, refuse, SettingsFile(bench.path, is_read=False))
    with pytest.raises(ConfigError, match="no such file"):
        settings.set(FIELDS["control.max_linear"], "0.5")
    assert settings.wanted == Config()


def test_what_is_changed_elsewhere_is_taken_over(bench: Bench) -> None:
    bench.set("camera.fps", "15")
    bench.running = load(None, None, {"control": {"actions": {"Peace": "turbo"}}})
    bench.settings.follow()
    assert bench.shown("control.actions") == {"Peace": "turbo"}
    assert bench.shown("camera.fps") == 15


SECTIONS = {
    "control": st.fixed_dictionaries(
        {},
        optional={
            "max_linear": st.floats(0.1, 10),
            "cmd_vel_type": st.sampled_from(["auto", "twist", "twist_stamped"]),
            "actions": st.dictionaries(st.sampled_from(["Peace", "Hi"]), st.sampled_from(["go", "turbo"])),
        },
    ),
    "robot": st.fixed_dictionaries(
        {},
        optional={
            "kind": st.sampled_from(["sim", "auto", "ros2", "dds", "ros1"]),
            "preset": st.sampled_from([None, *PRESETS]),
            "max_linear": st.floats(0.1, 10),
            "cmd_vel_type": st.sampled_from(["auto", "twist", "twist_stamped"]),
        },
    ),
    "dashboard": st.fixed_dictionaries({}, optional={"certificate": st.just("a.pem"), "port": st.integers(0, 65535)}),
}


@given(st.fixed_dictionaries({}, optional=SECTIONS))
def test_what_differs_from_the_defaults_is_all_that_is_needed(values: dict[str, Any]) -> None:
    config = load(None, None, values)
    differences = changed(config)
    assert loaded(differences) == config
    base = defaults(config)
    for field in differences:
        is_robot = field.path in {"robot.kind", "robot.preset"}
        assert is_robot or field.value_in(base) != field.value_in(config)


def test_saves_what_differs_and_the_next_start_has_it(bench: Bench) -> None:
    was_saved = bench.settings.is_saved
    assert was_saved
    bench.set("control.actions", "Peace: turbo")
    bench.set("camera.source", "rtsp://me:pa55@cam/1")
    was_saved = bench.settings.is_saved
    assert not was_saved
    bench.settings.save()
    assert bench.settings.is_saved
    assert load(bench.path) == bench.settings.wanted
    assert bench.path.read_text() == "camera:\n  source: rtsp://me:pa55@cam/1\ncontrol:\n  actions:\n    Peace: turbo\n"
    assert bench.path.stat().st_mode & 0o077 == 0
    assert list(bench.path.parent.iterdir()) == [bench.path]


def test_keeps_the_order_of_the_file_and_a_copy_of_its_comments(tmp_path: Path) -> None:
    text = "# mine\ncontrol: {max_linear: 0.5, linear_step: 0.02}\ncamera: {fps: 15}\n"
    bench = Bench(tmp_path, text=text)
    bench.path.chmod(0o640)
    bench.set("camera.fps", "20")
    bench.set("control.ramp", "per_second")
    assert bench.settings.save() == "saved to my.yaml; the old one, with its comments, is my.yaml.bak"
    assert (tmp_path / "my.yaml.bak").read_text() == text
    saved = " ".join(bench.path.read_text().split())
    assert saved == "control: max_linear: 0.5 linear_step: 0.02 ramp: per_second camera: fps: 20.0"
    assert bench.path.stat().st_mode & 0o777 == 0o640
    assert bench.settings.save() == "saved to my.yaml"


def test_options_that_the_file_does_not_have_are_not_saved_yet(tmp_path: Path) -> None:
    bench = Bench(tmp_path, {"camera": {"source": "virtual"}}, "control: {max_linear: 0.5}\n")
    assert not bench.settings.is_saved


def test_never_writes_over_what_somebody_else_wrote(bench: Bench) -> None:
    bench.set("control.max_linear", "0.4")
    bench.path.write_text("control: {max_linear: 0.3}\ncamera: {fps: 10}\n")
    with pytest.raises(ConfigError, match=r"my.yaml exists, and was not read: load it first"):
        bench.settings.save()
    bench.settings.load()
    assert (bench.running.control.max_linear, bench.shown("camera.fps")) == (0.3, 10)
    bench.set("camera.fps", "12")
    bench.path.write_text("camera: {fps: 11}\n")
    with pytest.raises(ConfigError, match=r"my.yaml was changed by another program"):
        bench.settings.save()
    assert bench.path.read_text() == "camera: {fps: 11}\n"


@pytest.mark.parametrize("text", [None, "control: {max_linear: 0.5}\n"], ids=["saved before", "read at the start"])
def test_a_file_that_was_deleted_is_written_again(tmp_path: Path, text: str | None) -> None:
    bench = Bench(tmp_path, text=text)
    bench.set("camera.fps", "12")
    bench.settings.save()
    before = load(bench.path)
    bench.path.unlink()
    assert bench.settings.save() == "saved to my.yaml"
    assert load(bench.path) == before == bench.settings.wanted
    bench.path.write_text("camera: {fps: 11}\n")
    with pytest.raises(ConfigError, match=r"my.yaml was changed by another program"):
        bench.settings.save()


def test_values_that_are_kept_in_a_file_that_was_deleted_are_known(tmp_path: Path) -> None:
    bench = Bench(tmp_path, text="control: {max_linear: 0.5}\n")
    bench.path.unlink()
    bench.settings.keep({MODEL: tmp_path / "mine.npz"})
    assert bench.settings.save() == "saved to my.yaml", "it knows what it has written"


def test_a_file_that_cannot_be_used_changes_nothing(bench: Bench) -> None:
    with pytest.raises(ConfigError, match="cannot read the configuration"):
        bench.settings.load()
    bench.path.write_text("control: {max_linear: 99}\n")
    with pytest.raises(ConfigError, match=r"control.max_linear: 99 should be"):
        bench.settings.load()
    assert bench.settings.wanted == bench.running == Config()
    with pytest.raises(ConfigError, match="was not read"):
        bench.settings.save()


def test_what_cannot_be_written_is_said(tmp_path: Path) -> None:
    settings = Settings(Config, lambda _: None, SettingsFile(tmp_path / "gone" / "my.yaml", is_read=False))
    with pytest.raises(ConfigError, match=r"cannot write .*my.yaml: No such file"):
        settings.save()


def test_a_graph_drives_on_by_what_is_set(tmp_path: Path) -> None:
    given = {"camera": {"source": "virtual", "width": 64, "height": 48}, "robot": {"world": "empty"}}
    with Graph(load(None, None, given), SteppedClock()) as graph:
        settings = Settings(lambda: graph.config, graph.reconfigure, SettingsFile(tmp_path / "my.yaml", is_read=False))
        speeds: list[float] = []
        graph.transport.subscribe("test", CMD_VEL, lambda received: speeds.append(received.message.linear.x))
        sign = graph.transport.advertise("test", HAND_SIGN)

        def show(name: str) -> float:
            sign.publish(String(data=name), graph.clock.now())
            graph.control.spin_once()
            return speeds[-1]

        show("Forward")
        assert show("Forward") == pytest.approx(0.02)
        settings.set(FIELDS["control.actions"], "Peace: forward")
        assert show("Go") == pytest.approx(0.02)
        assert show("Peace") == pytest.approx(0.03)
        settings.set(FIELDS["control.max_linear"], "0.02")
        assert show("Go") == pytest.approx(0.02)
        settings.set(FIELDS["control.linear_step"], "0.2")
        assert show("Forward") == 0.0  # what would make it faster stops it
        assert show("Stop") == 0.0
        settings.set(FIELDS["control.max_linear"], "1")
        assert show("Peace") == pytest.approx(0.2)


def test_every_section_has_its_fields() -> None:
    assert list(FORM) == list(Config.model_fields)


ACTIONS, MODEL = FIELDS["control.actions"], FIELDS["signs.model"]


def test_some_values_are_kept_in_the_file_without_the_rest_that_runs(tmp_path: Path) -> None:
    bench = Bench(tmp_path, {"camera": {"fps": 15}}, "control:\n  max_linear: 0.4\n")
    bench.set("control.max_angular", "1.5")
    assert bench.settings.keep({ACTIONS: {"Peace": "turbo"}, MODEL: tmp_path / "mine.npz"}) == "saved to my.yaml"
    config = load(bench.path)
    assert (config.control.max_linear, config.control.actions) == (0.4, {"Peace": "turbo"})
    assert (config.control.max_angular, config.camera.fps) == (Config().control.max_angular, 30)
    assert bench.settings.in_file(MODEL) == tmp_path / "mine.npz"
    assert bench.shown("control.max_angular") == 1.5, "what is wanted stays wanted"
    assert bench.settings.save() == "saved to my.yaml", "it knows what it has written"
    bench.settings.keep({ACTIONS: {}, MODEL: None})
    assert (load(bench.path).signs.model, load(bench.path).control.actions) == (None, {})


def test_a_file_that_was_not_read_keeps_its_content_and_is_not_overwritten_later(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    assert bench.settings.in_file(MODEL) is None
    bench.path.write_text("control:\n  max_linear: 0.4\n")
    bench.settings.keep({MODEL: tmp_path / "mine.npz"})
    assert (load(bench.path).control.max_linear, load(bench.path).signs.model) == (0.4, tmp_path / "mine.npz")
    with pytest.raises(ConfigError, match="exists, and was not read"):
        bench.settings.save()
    bench.path.write_text("contrl: {}\n")
    with pytest.raises(ConfigError, match="contrl"):
        bench.settings.keep({MODEL: None})
    assert bench.path.read_text() == "contrl: {}\n"
