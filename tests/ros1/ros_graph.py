"""A ROS graph of one's own for tests: a master on a free port, launches, and what there is to see from outside."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROS = ROOT / "ros"
DEBIAN_PYTHON = "/usr/bin/python3"
PATIENCE_S = 90.0

needs_ros = pytest.mark.skipif(
    not all(shutil.which(tool) for tool in ("roscore", "roslaunch", "rospack")), reason="ROS 1 is not here: make ros1"
)


def ros_environment(**more: str) -> dict[str, str]:
    """Return this process's environment, with the packages of this repository, no display, and the tested handsteer."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("ROS_") and name != "DISPLAY"}
    paths = f"{Path(sys.executable).parent}:{kept['PATH']}"
    return {**kept, "PATH": paths, "ROS_HOSTNAME": "localhost", "ROS_PACKAGE_PATH": str(ROS), **more}


def run(*command: str, env: dict[str, str], timeout_s: float = PATIENCE_S) -> str:
    """Run ``command`` and return what it prints; it must succeed."""
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=timeout_s, check=False)
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout


def eventually(condition: Callable[[], Any], what: str, patience_s: float = PATIENCE_S) -> Any:
    """Wait until ``condition`` returns something true; return it."""
    end_s = time.monotonic() + patience_s
    while time.monotonic() < end_s:
        result = condition()
        if result:
            return result
        time.sleep(0.05)
    raise AssertionError(f"not within {patience_s:g} s: {what}")


class Launch:
    """A ``roslaunch`` that runs; its output is in ``log``."""

    def __init__(self, command: list[str], env: dict[str, str], log: Path) -> None:
        self.log = log
        with log.open("w") as output:
            self.process = subprocess.Popen(command, env=env, stdout=output, stderr=subprocess.STDOUT)

    @property
    def said(self) -> str:
        """What has been printed so far."""
        return self.log.read_text(errors="replace")

    def stop(self) -> None:
        """End it as Ctrl-C does."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(30)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()


class Recorder:
    """A rospy process that writes down what comes, each with the time of arrival on this machine's monotonic clock."""

    def __init__(self, env: dict[str, str], topics: dict[str, str], path: Path) -> None:
        self._path = path
        with path.open("w") as output:
            self._process = subprocess.Popen(
                [DEBIAN_PYTHON, str(Path(__file__).with_name("record.py")), json.dumps(topics)], env=env, stdout=output
            )
        eventually(lambda: self._path.stat().st_size, "the recorder is ready")

    def of(self, topic: str, since_s: float = 0.0) -> list[dict[str, Any]]:
        """Return what came on ``topic`` since ``since_s``, oldest first."""
        lines = self._path.read_text().split("\n")[1:-1]
        records = [json.loads(line) for line in lines if f'"{topic}"' in line]
        return [record for record in records if record["at_s"] >= since_s]

    def stop(self) -> None:
        """End it."""
        self._process.kill()
        self._process.wait()


class RosGraph:
    """A master of one's own and what runs on it; everything ends with it."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        self.folder = folder
        self.uri = f"http://localhost:{port}"
        self.env = ros_environment(ROS_MASTER_URI=self.uri, ROS_HOME=str(folder), ROS_LOG_DIR=str(folder / "log"))
        self._running: list[Launch | Recorder] = [
            Launch(["roscore", "-p", str(port)], self.env, folder / "roscore.txt")
        ]
        eventually(self.nodes, "the master answers")

    def launch(self, package: str, file: str, *args: str, **env: str) -> Launch:
        """Start ``roslaunch``; the caller waits for whatever it needs."""
        log = self.folder / f"launch{len(self._running)}.txt"
        launch = Launch(["roslaunch", "--wait", package, file, *args], {**self.env, **env}, log)
        self._running.append(launch)
        return launch

    def record(self, **topics: str) -> Recorder:
        """Write down what comes on topics, given as ``name="package/Type"`` with ``__`` for slashes in names."""
        path = self.folder / f"record{len(self._running)}.jsonl"
        named = {"/" + name.replace("__", "/"): kind for name, kind in topics.items()}
        recorder = Recorder(self.env, named, path)
        self._running.append(recorder)
        return recorder

    def nodes(self) -> list[str]:
        """Return the names of all nodes that the master knows; none while it does not answer."""
        try:
            publishers, subscribers, _ = self._master("getSystemState")
        except OSError:
            return []
        return sorted({node for topics in (publishers, subscribers) for _, nodes in topics for node in nodes})

    def topics(self) -> dict[str, tuple[set[str], set[str]]]:
        """Return who publishes and who subscribes to each topic."""
        publishers, subscribers, _ = (dict(topics) for topics in self._master("getSystemState"))
        names = {*publishers, *subscribers}
        return {name: (set(publishers.get(name, ())), set(subscribers.get(name, ()))) for name in names}

    def set(self, **parameters: str | float) -> None:
        """Set parameters, given as ``node__section__name=value``."""
        for name, value in parameters.items():
            self._master("setParam", "/" + name.replace("__", "/"), value)

    def pid(self, node: str) -> int | None:
        """Return the process that ``node`` runs in, or None while it does not answer."""
        try:
            uri = self._master("lookupNode", node)
            return int(_ask(uri, "getPid"))
        except (OSError, LookupError):
            return None

    def tell(self, *command: str) -> str:
        """Run one of ROS's command line tools and return what it prints."""
        return run(*command, env=self.env)

    def stop(self) -> None:
        """End everything, the master last."""
        for running in reversed(self._running):
            running.stop()

    def _master(self, method: str, *arguments: Any) -> Any:
        return _ask(self.uri, method, *arguments)


@contextmanager
def ros_graph(folder: Path) -> Iterator[RosGraph]:
    """A graph that ends with the block."""
    graph = RosGraph(folder)
    try:
        yield graph
    finally:
        graph.stop()


def _ask(uri: str, method: str, *arguments: Any) -> Any:
    with ServerProxy(uri) as server:
        code, message, value = getattr(server, method)("/test", *arguments)
    if code != 1:
        raise LookupError(message)
    return value
