"""A process that was started here, and what it may send."""

import os
from pathlib import Path

import pytest

from handsteer.transports.child import Child
from tests.processes import eventually

PROGRAM = """
import os, pathlib
from handsteer.transports.child import serve_parent

class Runs:
    def __reduce__(self):
        return os.mkdir, ("made",)

def serve(pipe):
    pipe.start()
    pipe.say("told", Runs())
    pipe.say("told", pathlib.Path("data"))

if __name__ == "__main__":
    serve_parent(serve)
"""


def test_a_child_cannot_run_code_in_its_parent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_child.py").write_text(PROGRAM)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.chdir(tmp_path)
    child = Child("my_child")
    heard: list[object] = []
    child.pipe.on("told", heard.append)
    child.pipe.start()
    eventually(lambda: heard)
    child.stop()
    assert heard == [Path("data")]
    assert not Path("made").exists()
