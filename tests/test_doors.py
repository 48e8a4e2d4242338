"""Plug-ins of other distributions come in by entry points: each example of docs/plugins.md, and what is wrong."""

import importlib
import os
import re
import subprocess
import sys
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from handsteer import doors
from handsteer.cameras import Camera
from handsteer.clock import SteppedClock
from handsteer.config import Config
from handsteer.errors import PluginError
from handsteer.graph import Graph
from handsteer.recognition.hand import Classifier
from handsteer.robots import Robot
from handsteer.types import Velocity
from tests.contracts.node_contract import VIRTUAL
from tests.processes import START_S

ROOT = Path(__file__).resolve().parents[1]
DOCUMENT = (ROOT / "docs" / "plugins.md").read_text()
MOST_LINES = 40
FREE = ("--control.arming", "off", "--control.engage", "off", "--robot.odom-timeout", "10")
Run = Callable[..., subprocess.CompletedProcess[str]]


def example(title: str) -> str:
    """Return the program below a heading of docs/plugins.md."""
    found = re.search(rf"^## {title}\n.*?```python\n(.*?)```", DOCUMENT, re.DOTALL | re.MULTILINE)
    assert found, title
    return found[1]


def search_again() -> None:
    """Let the doors look for what is installed now."""
    for cached in (doors._installed, doors._entries):
        if hasattr(cached, "cache_clear"):
            cached.cache_clear()


class Installed:
    """A folder on the path with distributions of others."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.said: list[str] = []

    def file(self, name: str, text: str) -> str:
        """Write a file next to the modules; return its path."""
        (self._folder / name).write_text(text)
        return str(self._folder / name)

    def add(self, name: str, code: str, **groups: str) -> None:
        """Install the distribution and module ``name``; ``groups`` are entry points, as ``robots="scale = Scale"``."""
        (self._folder / f"{name}.py").write_text(code)
        about = self._folder / f"{name}-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        lines = [f"[handsteer.{group}]\n{entry.replace('= ', f'= {name}:')}\n" for group, entry in groups.items()]
        (about / "entry_points.txt").write_text("\n".join(lines))
        search_again()

    @contextmanager
    def started(self, *words: str) -> Iterator[str]:
        """Run the command line meanwhile; give the address of its page."""
        command = [sys.executable, "-m", "handsteer", *words]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=self._env, cwd=self._folder) as process:
            assert process.stderr is not None
            for line in process.stderr:
                self.said.append(line)
                if found := re.search(r"the page is at (http://[\w.:]+)", line):
                    break
            try:
                assert found, "".join(self.said)
                yield found[1]
            finally:
                process.terminate()
                try:
                    process.wait(START_S)
                finally:
                    process.kill()

    @property
    def _env(self) -> dict[str, str]:
        return {**os.environ, "PYTHONPATH": str(self._folder)}

    def run(self, *words: str, code: int = 0) -> subprocess.CompletedProcess[str]:
        """Run the command line with what is installed here; return what it printed."""
        command = [sys.executable, "-m", "handsteer", *words]
        done = subprocess.run(command, capture_output=True, text=True, env=self._env, cwd=self._folder, check=False)
        assert done.returncode == code, done.stderr
        return done


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Installed:
    monkeypatch.syspath_prepend(str(tmp_path))
    return Installed(tmp_path)


@pytest.fixture(autouse=True)
def forget() -> Any:
    """Forget after each test what it has installed."""
    yield
    search_again()


@pytest.mark.parametrize(
    "title", ["Camera", "Robot", "Transport", "Page", "Verb", "Action", "Assist", "Classifier", "Parameters"]
)
def test_an_example_is_short(title: str) -> None:
    assert len(example(title).splitlines()) <= MOST_LINES


@pytest.mark.slow
def test_a_camera(installed: Installed) -> None:
    installed.add("noisy", example("Camera"), cameras="noise = Noise")
    done = installed.run("run", "--headless", "--fast", "--duration", "2", "--camera", "noise")
    assert re.search(r"^ran for 2.0 s: 60 frames.*\nsigns: NONE 60$", done.stdout, re.MULTILINE)


@pytest.mark.slow
def test_a_robot_is_driven_by_signs(installed: Installed) -> None:
    installed.add("scale", example("Robot"), robots="scale = Scale")
    done = installed.run("run", "--headless", "--duration", "10", *VIRTUAL, "--robot", "scale", *FREE)
    went = re.search(r"^went (\d\.\d+) m$", done.stdout, re.MULTILINE)
    assert went
    assert float(went[1]) > 0.2


@pytest.mark.slow
def test_a_transport(installed: Installed) -> None:
    installed.add("alone", example("Transport"), transports="alone = Alone")
    assert "alone" in installed.run("control", "--transport", "alon", code=2).stderr
    program = "from handsteer.transports import join\nsession = join('alone', 'my_node', [])\nprint(session.name)"
    env = {**os.environ, "PYTHONPATH": str(installed._folder)}
    done = subprocess.run([sys.executable, "-c", program], env=env, capture_output=True, text=True, check=True)
    assert done.stdout == "/my_node\n"


@pytest.mark.slow
def test_a_verb_is_listed_and_runs(installed: Installed) -> None:
    installed.add("greeting", example("Verb"), verbs="greet = greet")
    assert "Greet somebody." in installed.run("--help").stdout
    assert installed.run("greet", "--name", "Ada").stdout == "hello Ada\n"
    assert "greet" in installed.run("grete", code=2).stderr
    assert "greet" in installed.run("completion", "bash").stdout


def test_an_action_changes_the_velocity_within_the_limits(installed: Installed) -> None:
    from handsteer.control.sign_control import SignControl  # noqa: PLC0415

    installed.add("crawling", example("Action"), actions="crawl = Crawl")
    config = Config().control.model_copy(update={"actions": {"Go": "crawl"}, "max_linear": 0.04})
    control = SignControl(config)
    assert control.step("Go", 0.03) == Velocity(0.04, 0.0)
    assert control.step("Stop", 0.03) == Velocity()


def test_an_assist_is_chosen_by_its_name(installed: Installed) -> None:
    import numpy as np  # noqa: PLC0415

    from handsteer.control.assist import Around, assist_named, assisted  # noqa: PLC0415

    installed.add("calming", example("Assist"), assists="calm = Calm")
    calm, rule = assist_named("calm"), Config().collision_monitor
    assert calm is not None
    for x, linear_mps in ((0.9, 0.2), (1.1, 0.4)):
        velocity, _ = assisted(calm, Velocity(0.4, 0.1), Around(np.array([(x, 0.0)]), Velocity(), rule, 2.0, 0.0))
        assert velocity == Velocity(linear_mps, 0.1)


FAILING = """
class Breaks:
    effect = "breaks"

    def velocity(self, now, since_last_s):
        {body}
"""


@pytest.mark.parametrize(
    "body", ["raise ValueError('broken')", "raise SystemExit", "return None", "return type(now)(float('nan'), 1.0)"]
)
def test_an_action_that_fails_stops_the_robot(
    installed: Installed, body: str, caplog: pytest.LogCaptureFixture
) -> None:
    from handsteer.control.sign_control import SignControl  # noqa: PLC0415

    installed.add(f"breaking{len(body)}", FAILING.format(body=body), actions="breaks = Breaks")
    control = SignControl(Config().control.model_copy(update={"actions": {"Go": "breaks"}}))
    assert control.step("Forward", 0.03) == Velocity(0.01, 0.0)
    assert [control.step("Go", 0.03) for _ in range(5)] == [Velocity()] * 5
    assert control.velocity == Velocity()
    assert caplog.text.count("the action breaks has failed: the robot stops") <= 1


def test_an_action_that_failed_moves_nothing_before_a_sign_that_stops(installed: Installed) -> None:
    from handsteer.control.sign_control import SignControl  # noqa: PLC0415

    body = "if not now.is_zero:\n            raise ValueError\n        return type(now)(0.3, 0.0)"
    installed.add("sometimes", FAILING.format(body=body), actions="breaks = Breaks")
    control = SignControl(Config().control.model_copy(update={"actions": {"Go": "breaks"}}))
    assert [control.step("Go", 0.03) for _ in range(4)] == [Velocity(0.3, 0.0), *[Velocity()] * 3]
    assert control.step("Forward", 0.03) == Velocity()
    assert control.step("Stop", 0.03) == Velocity()
    assert control.step("Go", 0.03) == Velocity(0.3, 0.0)


@pytest.mark.slow
def test_an_action_is_known_by_the_command_line(installed: Installed) -> None:
    installed.add("crawling", example("Action"), actions="crawl = Crawl")
    listed = installed.run("signs", "list", "--control.actions.Go", "crawl").stdout
    assert "crawls forward while shown" in listed
    assert "'crawl'" in installed.run("signs", "list", "--control.actions.Go", "crwl", code=2).stderr


@pytest.mark.slow
def test_a_classifier_replaces_ours(installed: Installed) -> None:
    installed.add("always", example("Classifier"), classifiers="always = Always")
    done = installed.run("run", "--headless", "--fast", "--duration", "6", *VIRTUAL, "--signs.classifier", "always")
    assert re.search(r"signs: Stop \d+, NONE \d+$", done.stdout, re.MULTILINE)


@pytest.mark.slow
def test_parameters_are_options_in_the_file_and_listed(installed: Installed) -> None:
    installed.add("lamp", example("Parameters"), parameters="lamp = Lamp")
    assert "--lamp.brightness" in installed.run("parameters", "lamp").stdout
    error = installed.run("run", "--headless", "--lamp.brightness", "2", code=2).stderr
    assert "lamp.brightness: '2' should be less than or equal to 1" in error
    (installed._folder / "my.yaml").write_text("lamp:\n  brightness: high\n")
    assert "lamp.brightness" in installed.run("run", "--headless", "--config", "my.yaml", code=2).stderr


@pytest.mark.slow
def test_the_example_is_installed_by_pip_and_drives(tmp_path: Path, installed: Installed) -> None:
    pip = ["uv", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", "--target", str(tmp_path)]
    folder = str(ROOT / "examples" / "plugin")
    subprocess.run([str(Path(sys.executable).with_name(pip[0])), *pip[1:], folder], check=True)
    lines = [line for file in Path(folder).glob("*.*") for line in file.read_text().splitlines()]
    assert len(lines) <= 80
    driven = ("--robot", "printer", "--printer.period", "0.5", "--control.actions.Go", "blink")
    script = ("--virtual-hand.script", "Forward:2 Go:2")
    done = installed.run("run", "--headless", "--duration", "10", *VIRTUAL, *script, *driven, *FREE)
    assert "blink" in done.stdout
    speeds = [float(speed) for speed in re.findall(r"printer: (-?\d\.\d\d) m/s", done.stdout)]
    assert len(speeds) > 8
    assert max(speeds) > 0.2
    drawn = installed.run("run", "--headless", "--fast", "--duration", "2", "--camera", "drawing")
    assert re.search(r"^ran for 2.0 s: 60 frames.*\nsigns: none$", drawn.stdout, re.MULTILINE)


@pytest.mark.slow
def test_the_example_passes_the_contract_of_robots(tmp_path: Path) -> None:
    (tmp_path / "test_contract.py").write_text(example("Tests"))
    path = [str(ROOT / "examples" / "plugin"), str(tmp_path)]
    add = "[project.entry-points.'handsteer.parameters']"
    assert add
    installed = Installed(tmp_path)
    installed.add(
        "handsteer_example_parameters",
        "from handsteer_example import PrinterConfig",
        parameters="printer = PrinterConfig",
    )
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(path)}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path / "test_contract.py")]
    done = subprocess.run(command, env=env, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "9 passed" in done.stdout, done.stdout


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        ("import nothing_of_this_name", "ModuleNotFoundError: No module named 'nothing_of_this_name'"),
        ("raise RuntimeError('no licence')", "RuntimeError: no licence"),
        ("raise SystemExit(0)", "SystemExit: 0"),
        ("", "AttributeError: module 'broken"),
    ],
)
def test_what_cannot_be_loaded_is_reported_with_its_distribution(installed: Installed, code: str, reason: str) -> None:
    name = f"broken{len(code)}"
    installed.add(name, code, robots="broken = Robot")
    with pytest.raises(PluginError, match=rf"^the robot broken of {name} cannot be loaded: {reason}"):
        doors.ROBOTS.load("broken")


def test_what_is_opened_is_what_the_door_is_for(installed: Installed) -> None:
    code = "class Half:\n    def __init__(self, *_): pass\n    def step(self): pass\n    def close(self): pass\n"
    installed.add("halves", f"{code}def nothing(*_): pass\n", robots="half = Half", cameras="none = nothing")
    lacks = "description, command, obstacles, scan, commanders"
    with pytest.raises(PluginError, match=f"^the robot half of halves is of type Half without {lacks}$"):
        doors.ROBOTS.open("half", Config(), SteppedClock())
    with pytest.raises(PluginError, match=r"^the camera none of halves is of type NoneType without name, period_s,"):
        doors.CAMERAS.open("none", Config(), SteppedClock())


@pytest.mark.parametrize(
    ("door", "protocol"), [(doors.CAMERAS, Camera), (doors.ROBOTS, Robot), (doors.CLASSIFIERS, Classifier)]
)
def test_a_door_needs_all_of_its_protocol(door: doors.Door[Any], protocol: type) -> None:
    assert set(door._needs) == {name for name in vars(protocol) if not name.startswith("_")}


def test_what_exits_while_it_is_opened_is_reported(installed: Installed) -> None:
    installed.add("leaving", "import sys\ndef leave(*_): sys.exit(0)\n", robots="leaves = leave")
    with pytest.raises(PluginError, match=r"^the robot leaves of leaving cannot be opened: SystemExit: 0$"):
        doors.ROBOTS.open("leaves", Config(), SteppedClock())


@pytest.mark.parametrize("period", ["float('nan')", "-1", "0", "'30'", "float('inf')"])
def test_a_camera_with_another_period_is_refused(installed: Installed, period: str) -> None:
    from handsteer.cameras.choose import open_camera  # noqa: PLC0415

    code = f"class Odd:\n    name, period_s, read = 'odd', {period}, None\n    def __init__(self, *_): pass\n"
    installed.add("odd", f"{code}    def close(self): pass\n", cameras="odd = Odd")
    config = Config.model_validate({"camera": {"source": "odd"}})
    with pytest.raises(
        PluginError, match=r"^the camera odd of odd cannot be used: its period_s is .*, not a number of"
    ):
        open_camera(config, SteppedClock())


@pytest.mark.slow
def test_verbs_that_cannot_be_used_are_left_out_of_the_help(installed: Installed) -> None:
    installed.add("leaving", "raise SystemExit(0)", verbs="leave = leave")
    installed.add("failing", "raise RuntimeError('no licence')", verbs="fail = fail")
    installed.add("number", "five = 5", verbs="five = five")
    installed.add("greeting", example("Verb"), verbs="greet = greet")
    said = {
        "leave": "handsteer: the verb leave of leaving cannot be loaded: SystemExit: 0",
        "fail": "handsteer: the verb fail of failing cannot be loaded: RuntimeError: no licence",
        "five": "handsteer: the verb five of number is of type int, not a function or an app",
    }
    for words in (("--help",), ("completion", "bash")):
        done = installed.run(*words)
        assert "greet" in done.stdout
        assert done.stderr.splitlines() == [f"{line}; it is left out" for _, line in sorted(said.items())]
    for verb, line in said.items():
        assert installed.run(verb, code=2).stderr == f"{line}\n"


@pytest.mark.slow
def test_a_verb_returns_an_exit_code_or_nothing(installed: Installed) -> None:
    installed.add("talking", "def talk(): return 'hello'\ndef count() -> int: return 3\n", verbs="talk = talk")
    error = installed.run("talk", code=2).stderr
    assert error == "handsteer: a verb should return an exit code or None, and talking returned 'hello'\n"


@pytest.mark.parametrize(
    ("group", "words", "said"),
    [
        ("cameras", ("--camera", "mine"), "the camera mine of broken cannot be opened: RuntimeError: no device"),
        ("robots", ("--robot", "mine"), "the robot mine of broken cannot be opened: RuntimeError: no device"),
        (
            "classifiers",
            ("--signs.classifier", "mine"),
            "the classifier mine of broken cannot be opened: RuntimeError:",
        ),
    ],
)
def test_what_cannot_be_opened_is_reported_with_its_distribution(
    installed: Installed, group: str, words: tuple[str, ...], said: str
) -> None:
    installed.add("broken", "def make(*given):\n    raise RuntimeError('no device')\n", **{group: "mine = make"})
    camera = () if group == "cameras" else ("--camera", "virtual")
    error = installed.run("run", "--headless", "--duration", "1", *camera, *words, code=2).stderr
    assert said in error
    assert "Traceback" not in error


@pytest.mark.slow
def test_parameters_may_be_in_the_module_of_a_verb_or_transport(installed: Installed) -> None:
    code = example("Parameters") + example("Verb").replace("from __future__ import annotations\n", "")
    installed.add("lamp", code, parameters="lamp = Lamp", verbs="greet = greet")
    assert "left out" not in installed.run("greet").stderr
    installed.add(
        "torch", example("Parameters") + example("Transport"), parameters="torch = Lamp", transports="t = Alone"
    )
    assert "--torch.brightness" in installed.run("parameters", "torch").stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    "imported",
    [
        "handsteer.graph import Graph",
        "handsteer import Recognizer, Teleop",
        "handsteer.making import make_control",
        "handsteer.plugins.page.page import Page",
    ],
)
@pytest.mark.parametrize("verb", ["run", "signs list", "control --transport dds"])
def test_parameters_may_be_in_a_module_that_imports_any_other(installed: Installed, imported: str, verb: str) -> None:
    installed.add("mine", f"from {imported}\n{example('Parameters')}", parameters="lamp = Lamp")
    file = installed.file("my.yaml", f"lamp: {{brightness: {0.7 if verb == 'run' else 7}}}")
    if verb == "run":
        with installed.started("run", "--camera", "virtual", "--port", "0", "--config", file) as address:
            urllib.request.urlopen(address).close()
        assert not [line for line in installed.said if "lamp" in line]
    else:
        assert "lamp.brightness: 7 should be" in installed.run(*verb.split(), "--config", file, code=2).stderr


def test_an_unknown_name_gets_the_nearest(installed: Installed) -> None:
    installed.add("scale", example("Robot"), robots="scale = Scale")
    with pytest.raises(PluginError, match=r"^there is no robot 'scal': did you mean scale\? installed are sim, scale$"):
        doors.ROBOTS.load("scal")


def test_an_installation_from_before_the_doors_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doors, "_installed", tuple)
    with pytest.raises(PluginError, match=r"^handsteer's own entry points are missing: install it again"):
        doors.CAMERAS.load("virtual")


def test_ours_cannot_be_replaced(installed: Installed, caplog: pytest.LogCaptureFixture) -> None:
    installed.add("a_thief", "Robot = None", robots="sim = Robot")
    assert doors.ROBOTS.target("sim") == "handsteer.plugins.sim.door:open_robot"
    assert "a_thief:Robot has the name sim of handsteer.plugins.sim.door:open_robot, and is not used" in caplog.text


@pytest.mark.slow
def test_parameters_that_cannot_be_loaded_keep_nobody_from_driving(installed: Installed) -> None:
    installed.add("broken", "raise RuntimeError('no licence')", parameters="broken = Broken")
    done = installed.run("run", "--headless", "--fast", "--duration", "1", *VIRTUAL)
    assert (
        "the parameters broken are left out: the section of parameters broken of broken cannot be loaded" in done.stderr
    )


def test_all_that_is_ours_can_be_loaded() -> None:
    for door in (doors.CAMERAS, doors.ROBOTS, doors.TRANSPORTS, doors.VERBS, doors.PAGES, doors.RECORDERS):
        assert door.names()
        for name in door.names():
            module, _, attribute = door.target(name).partition(":")
            assert hasattr(importlib.import_module(module), attribute)


@pytest.mark.slow
def test_a_graph_takes_a_camera_a_recognizer_and_a_robot() -> None:
    from handsteer.cameras.choose import open_camera  # noqa: PLC0415
    from handsteer.making import open_robot  # noqa: PLC0415
    from handsteer.recognition.recognizer import Recognizer  # noqa: PLC0415

    config = Config.model_validate({"camera": {"source": "virtual", "width": 320, "height": 240}})
    clock = SteppedClock()
    parts: dict[str, Any] = {
        "camera": open_camera(config, clock),
        "recognizer": Recognizer(config),
        "robot": open_robot(config, clock),
    }
    with Graph(config, clock, **parts) as graph:
        graph.run_stepped(5.0)
        # A robot that is given counts as a real one: nobody has engaged.
        assert graph.robot.path_length_m < 0.001
        assert graph.summary().signs["Forward"] > 30


@pytest.mark.slow
def test_a_page_is_served_and_linked(installed: Installed) -> None:
    installed.add("speed", example("Page"), pages="speed = Speed")
    words = ("run", *VIRTUAL, "--port", "0", "--dashboard.no-open-browser")
    with installed.started(*words) as address:
        for path in ("", "speed"):
            with urllib.request.urlopen(f"{address}/{path}", timeout=30) as answer:
                text = answer.read().decode()
            assert '"href":"/speed"' in text.replace(" ", "")
            assert ("font-size" in text and "20vw" in text) == (path == "speed")
