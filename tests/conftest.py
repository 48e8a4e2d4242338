"""What tests share: where the real photos and clips are, and a ROS 1 graph."""

import atexit
import datetime
import faulthandler
import importlib.util
import os
import shutil
import signal
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from _pytest.faulthandler import fault_handler_stderr_fd_key
from hypothesis import settings

from handsteer.clock import SteppedClock
from handsteer.config import DEFAULT_FILE, Config, VirtualHandConfig
from handsteer.graph import Graph
from tests.reasons import check_made, watch_recordings
from tests.ros1.graph import Ros1Graph, ros1_graph
from tests.turns import Turns

for contract in ("camera", "robot", "transport"):
    pytest.register_assert_rewrite(f"handsteer.testing.{contract}_contract")

# The machines that run the tests are shared: how long an example takes says nothing of the code.
settings.register_profile("handsteer", deadline=None)
settings.load_profile("handsteer")

_NETWORKS = {"machines", "alone"}

RUN_AGAIN = (
    "tests/cli",
    "tests/plugins/page",
    "tests/dds",
    "tests/distributed",
    "tests/faults/test_networks.py",
    "tests/faults/test_processes.py",
    "tests/faults/test_sleep.py",
    "tests/plugins/foxglove",
    "tests/plugins/record",
    "tests/plugins/ros1",
    "tests/rmw_zenoh",
    "tests/ros1",
    "tests/ros2",
    "tests/test_doors.py",
    "tests/test_examples.py",
    "tests/test_wheel.py",
    "tests/transports",
)
"""Where a test that is slow, or needs ROS 1, and fails is run once more, one with a browser twice more: these drive
real processes in real time, which a machine that is busy with other things may upset, so that they are then run
alone. What is wrong fails each time; the last line of a run counts what was run again."""

LONG_VALUE = 100
"""Longer texts, in characters, are not part of a test's name."""

LONGEST_REASON = 3000
"""The end of a failure that is printed of a test that was run again, in characters."""

HANGS_S = 960.0
"""After so long, a process whose test hangs prints the stacks of its threads and ends; pytest-xdist says which test it
was, and goes on with the others in another process. Longer than any timeout of pytest-timeout, which interrupts the
function of a test, once: neither its fixtures, nor what the function does at its end."""

SLOW = ("slow", "exhaustive")
"""Marks of what CI does not always run; what is exhaustive tries every case of what others try once."""
SLOW_UNTIL_S = float(os.environ.get("HANDSTEER_SLOW_UNTIL_S", "inf"))
"""So long after the start of the tests, these are skipped: CI has to end on a slow machine too."""
SLOW_DAY = os.environ.get("HANDSTEER_SLOW_DAY")
"""A date, as 2026-11-24: only its part of the slow and exhaustive tests is run, as in CI. Without it all are."""
SLOW_PARTS = 4
"""Each of these tests is run on one of so many successive days, and on each day a part of every long file of tests."""

_TURNS = pytest.StashKey[Turns]()

# Of the process that all others are started by.
_STARTED_S = float(os.environ.setdefault("HANDSTEER_TESTS_STARTED_S", str(time.monotonic())))

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Photos, clips and landmark rows of real people; kept beside the repository, never in it."""
    if not DATA.is_dir():
        pytest.skip(f"the real photos and clips are not there: {DATA}")
    return DATA


@pytest.fixture(scope="session")
def slideshow(data_dir: Path) -> Path:
    """A labelled slide show of people showing signs, 12 frames a second."""
    return data_dir / "videos" / "slideshow_emre_MIT_640x480.mp4"


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of eight seconds of a stepped run by the virtual hand."""
    path = tmp_path_factory.mktemp("recording") / "drive.mcap"
    config = Config(virtual_hand=VirtualHandConfig(script="Stop:1 Forward:2 Go:1 Turn Left:2 Stop:1 Backward:1"))
    with Graph(config, SteppedClock()) as graph:
        graph.record(path)
        graph.run_stepped(8.0)
    return path


watch_recordings()


@pytest.fixture(autouse=True)
def every_motion_has_a_reason() -> Iterator[None]:
    """Look through each recording that a test, or a fixture before it, has made."""
    yield
    check_made()


# What runs write for their users, such as the audit, must not be in the home of who runs the tests.
os.environ["XDG_STATE_HOME"] = tempfile.mkdtemp(prefix="handsteer-tests-")
atexit.register(shutil.rmtree, os.environ["XDG_STATE_HOME"], ignore_errors=True)

# Whoever starts the tests by nohup lets them, and all that they start, ignore SIGHUP; nodes are tested by it.
signal.signal(signal.SIGHUP, signal.SIG_DFL)


def pytest_configure(config: pytest.Config) -> None:
    """Refuse to start where ``handsteer run`` would read a file of parameters that is not the tests'."""
    if DEFAULT_FILE.exists():
        raise pytest.UsageError(f"move {DEFAULT_FILE.absolute()} away: the runs of the tests would read it")
    if workerinput := getattr(config, "workerinput", None):
        config.stash[_TURNS] = Turns(Path(workerinput["handsteer_turns"]))


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Tell each process of a parallel run where its locks are: in a folder of the first process, which removes it."""
    node.workerinput["handsteer_turns"] = os.environ["XDG_STATE_HOME"]


@pytest.hookimpl(tryfirst=True)  # pytest-xdist reads the groups in the same hook
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is in :data:`RUN_AGAIN`, what makes networks by the fixtures that make them, and what runs together.

    With ``--dist loadgroup``, one process runs the tests of a file, and one all that need a browser: without a graphics
    card, two that draw pages wait for each other. What takes longest comes first, so that no process is left with it
    at the end: the group with browsers, then those with other slow tests, then those in which all slow ones are
    exhaustive. In a group, what is exhaustive comes last.
    """
    ranks: dict[str, int] = {}
    for item in items:
        if not item.get_closest_marker("xdist_group"):
            group = "browser" if item.get_closest_marker("browser") else item.nodeid.partition("::")[0]
            item.add_marker(pytest.mark.xdist_group(group))
        if set(getattr(item, "fixturenames", ())) & _NETWORKS:
            item.add_marker(pytest.mark.netns)
        if any(map(item.get_closest_marker, ("slow", "ros1"))) and item.nodeid.startswith(RUN_AGAIN):
            reruns = 2 if item.get_closest_marker("browser") else 1  # drawn in software
            item.add_marker(pytest.mark.flaky(reruns=reruns))
        ranks[_group(item)] = max(ranks.get(_group(item), 0), _rank(item))
    items.sort(key=lambda item: (-ranks[_group(item)], _group(item), _is_exhaustive(item)))
    if SLOW_DAY:
        for number, item in enumerate(item for item in items if any(map(item.get_closest_marker, SLOW))):
            if not is_of_day(number, SLOW_DAY):
                item.add_marker(pytest.mark.skip(reason="left out, as it is slow: a test of another day"))


def is_of_day(number: int, day: str) -> bool:
    """Return whether the slow test of this number is run on ``day``."""
    return number % SLOW_PARTS == datetime.date.fromisoformat(day).toordinal() % SLOW_PARTS


def _group(item: pytest.Item) -> str:
    marker = item.get_closest_marker("xdist_group")
    assert marker is not None
    return str(marker.args[0])


def _is_exhaustive(item: pytest.Item) -> bool:
    return item.get_closest_marker("exhaustive") is not None


def _rank(item: pytest.Item) -> int:
    if item.get_closest_marker("browser"):
        return 3
    return 0 if not item.get_closest_marker("slow") else 1 if _is_exhaustive(item) else 2


def pytest_make_parametrize_id(val: object, argname: str) -> str | None:
    """Keep bytes and long texts out of the names of tests.

    An archive holds the second it was made in, so that workers would collect tests of different names.
    """
    return argname if isinstance(val, bytes) or (isinstance(val, str) and len(val) > LONG_VALUE) else None


def _end_if_it_hangs(item: pytest.Item) -> None:
    if item.config.getoption("timeout") == 0:  # make soak
        return
    uncaptured = item.config.stash[fault_handler_stderr_fd_key]
    faulthandler.dump_traceback_later(HANGS_S, exit=True, file=uncaptured)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Begin each try of a test with all its time, and skip what needs ROS 1, or time, where there is none."""
    if turns := item.config.stash.get(_TURNS, None):
        turns.begin(alone=getattr(item, "execution_count", 1) > 1)
    _end_if_it_hangs(item)
    there = importlib.util.find_spec("rospy") and shutil.which("roscore")
    if item.get_closest_marker("ros1") and not there:
        pytest.skip("ROS 1 is not installed: make ros1")
    if any(map(item.get_closest_marker, SLOW)) and time.monotonic() - _STARTED_S > SLOW_UNTIL_S:
        pytest.skip(f"left out, as it is slow: the tests have run for {SLOW_UNTIL_S:g} s")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> Iterator[None]:
    """Close the browser after the last test that uses it: without pages, too, it takes a good part of a processor."""
    _end_if_it_hangs(item)
    try:
        yield
        if item.get_closest_marker("browser") and (nextitem is None or not nextitem.get_closest_marker("browser")):
            from tests.plugins.page.browsers import close_shared  # noqa: PLC0415 - most files need no browser

            close_shared()
    finally:
        faulthandler.cancel_dump_traceback_later()
        if turns := item.config.stash.get(_TURNS, None):
            turns.end()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print why tests were run again: else the failure of a first try is lost."""
    for report in terminalreporter.stats.get("rerun", ()):
        terminalreporter.section(f"run again: {report.nodeid}", sep="_")
        terminalreporter.write_line(report.longreprtext[-LONGEST_REASON:])


@pytest.fixture(scope="module")
def ros1_master(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ros1Graph]:
    """A ROS 1 graph with a master of its own."""
    with ros1_graph(tmp_path_factory.mktemp("ros")) as graph:
        yield graph


@pytest.fixture
def ros1(ros1_master: Ros1Graph) -> Iterator[Ros1Graph]:
    """A ROS 1 graph for one test; mark the tests that use it ``ros1``."""
    with ros1_master.test():
        yield ros1_master
