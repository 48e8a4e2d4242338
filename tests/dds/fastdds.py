"""A program on Fast DDS, built for the tests from ``fastdds_peer.cpp``."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

from tests.processes import Peer

SOURCE = Path(__file__).with_name("fastdds_peer.cpp")
_HEADER = Path("/usr/include/fastdds/dds/domain/DomainParticipant.hpp")


def missing() -> str | None:
    """Return what keeps the program from being built; None when nothing does."""
    if not _HEADER.exists():
        return "no Fast DDS (Debian, Ubuntu: libfastrtps-dev)"
    return None if shutil.which("g++") else "no C++ compiler (g++)"


def build(folder: Path) -> Path:
    """Return the program, built in ``folder``."""
    program = folder / "fastdds_peer"
    command = ["g++", "-std=c++17", "-O1", str(SOURCE), "-o", str(program), "-lfastrtps", "-lfastcdr"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


class FastDdsPeer(Peer):
    """The program in a domain; its orders are told in the source."""

    def __init__(self, program: Path, domain: int, env: dict[str, str], log: Path) -> None:
        super().__init__([str(program), str(domain)], env, log)

    def tell(self, *words: object) -> Any:
        """Give an order of some words; return its answer."""
        assert self.popen.stdin is not None
        self.popen.stdin.write(" ".join(map(str, words)) + "\n")
        self.popen.stdin.flush()
        return json.loads(self._line())
