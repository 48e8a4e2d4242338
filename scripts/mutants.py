"""Break each guard of ``tests/mutants.toml`` in turn, and run the tests that name it, of which one has to fail.

A guard that no test fails without does not last. The working tree is never changed: a mutant is a folder of
links to the sources, with the one changed file in it, that is first on the path of a forked process.

Exit code 0 if all mutants die; 1 if one survives, if a text that is to be replaced does not occur exactly once, or if a
named test is not there, skipped, or fails without any change.
"""

import argparse
import ast
import contextlib
import datetime
import functools
import importlib
import os
import signal
import sys
import tempfile
import time
import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest

ROOT: Final = Path(__file__).resolve().parents[1]
SOURCES: Final = ROOT / "src" / "handsteer"
TABLE: Final = ROOT / "tests" / "mutants.toml"
FEWEST: Final = 60
PARTS: Final = 4
"""``--day`` takes one part of so many."""

INDIRECT: Final = ("test_histories.py", "test_stateful.py", "test_auditing.py", "test_audit.py", "mutants")
"""What these files see dies by chance, or by what is told of it: a guard needs a test of its own."""

# Imported once, before the forks; of handsteer nothing, so that each process has its own.
_LIBRARIES: Final = (
    "cv2",
    "hypothesis.strategies",
    "mujoco",
    "nicegui",
    "numpy",
    "pydantic",
    "rosbags.typesys",
    "starlette.applications",
    "websockets.sync.client",
)
_LONGEST_S: Final = 300.0
_LOOK_S: Final = 0.02
_SKIPPED: Final = 90
_LONGEST_LINE: Final = 120


@dataclass(frozen=True)
class Mutant:
    """A guard, and how to break it.

    Attributes:
        guard: What it guards against, in one sentence.
        file: Path below ``src/handsteer``.
        find: A text that occurs there once.
        replace: What takes its place.
        tests: Node IDs below ``tests`` of those that have to fail.
    """

    guard: str
    file: str
    find: str
    replace: str
    tests: tuple[str, ...]

    @property
    def source(self) -> str:
        """The text of the file, unchanged."""
        return (SOURCES / self.file).read_text(encoding="utf-8")

    @property
    def problem(self) -> str:
        """What is wrong with this row of the table; empty if nothing is."""
        if not (SOURCES / self.file).is_file():
            return f"there is no {self.file}"
        if (count := self.source.count(self.find)) != 1:
            return f"{self.find!r} occurs {count} times in {self.file}"
        if self.find == self.replace or not self.guard or not self.tests:
            return "it changes nothing, or names no guard or no test"
        return next((problem for test in self.tests if (problem := _problem_of(test))), "")


def _problem_of(test: str) -> str:
    file, *names = test.partition("[")[0].split("::")
    path = ROOT / "tests" / file
    if not path.is_file() or not names:
        return f"there is no test {test}"
    if path.name in INDIRECT:
        return f"{test} tests this guard only by chance"
    nodes: Sequence[ast.AST] = _parsed(path).body
    for name in names:
        found = [node for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name]
        if not found:
            return f"there is no test {test}"
        if any(ast.unparse(decorator).startswith("given(") for decorator in found[0].decorator_list):
            return f"{test} finds it only by chance"
        nodes = found[0].body
    return ""


@functools.cache
def _parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_bytes())


def read_table() -> list[Mutant]:
    """Return all mutants."""
    rows = tomllib.loads(TABLE.read_text(encoding="utf-8"))["mutant"]
    return [Mutant(**{**row, "tests": tuple(row["tests"])}) for row in rows]


def part_of_day(mutants: Sequence[Mutant], day: datetime.date) -> list[Mutant]:
    """Return those of one day: all come up within :data:`PARTS` days."""
    return list(mutants[day.toordinal() % PARTS :: PARTS])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--day", type=datetime.date.fromisoformat, help="only the quarter of this day, as 2026-11-24")
    parser.add_argument("--only", default="", metavar="TEXT", help="only rows with this text in guard, file or tests")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), metavar="N")
    parser.add_argument("--verbose", action="store_true", help="print by what each mutant died")
    asked = parser.parse_args()
    mutants = part_of_day(read_table(), asked.day) if asked.day else read_table()
    mutants = [each for each in mutants if asked.only in f"{each.guard} {each.file} {' '.join(each.tests)}"]
    began_s = time.monotonic()
    failed = [f"{mutant.guard}: {mutant.problem}" for mutant in mutants if mutant.problem]
    with tempfile.TemporaryDirectory(prefix="handsteer-mutants-") as name:
        failed = failed or _run_all(mutants, Path(name), asked.workers, verbose=asked.verbose)
    for line in failed:
        print(line)
    print(f"{len(mutants)} mutants, {len(failed)} problems, {time.monotonic() - began_s:.0f} s")
    return 1 if failed or not mutants else 0


@dataclass
class _Run:
    """A run of tests in a process of its own."""

    name: str
    tests: Sequence[str]
    folder: Path
    mutant: Mutant | None = None
    code: int = -1
    took_s: float = 0.0

    @property
    def output(self) -> str:
        return (self.folder / "output").read_text(encoding="utf-8", errors="replace")

    @property
    def error(self) -> str:
        """By what the first test failed."""
        lines = (line[2:].strip() for line in self.output.splitlines() if line.startswith("E  "))
        return next(lines, "")[:_LONGEST_LINE]

    def work(self) -> None:
        """Run the tests in this process, and end it."""
        output = os.open(self.folder / "output", os.O_WRONLY | os.O_CREAT)
        os.dup2(output, 1)
        os.dup2(output, 2)
        code = 1
        try:
            tree = self.folder / "src"
            _link(tree, self.mutant)
            sys.path.insert(0, str(tree))
            os.environ["PYTHONPATH"] = str(tree)
            os.environ.pop("HANDSTEER_SLOW_DAY", None)  # a test that is named here is run on any day
            # What tests leave behind goes with the folder.
            os.environ["TMPDIR"] = tempfile.tempdir = str(self.folder)
            os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = str(self.folder / "hypothesis")
            options = ["-q", "-p", "no:cacheprovider", f"--basetemp={self.folder / 'tests'}"]
            skips = _Skips()
            code = pytest.main([*options, *([] if self.mutant is None else ["-x"]), *self.tests], [skips])
            code = _SKIPPED if code == 0 and skips.count else code
            sys.stdout.flush()
        finally:
            os._exit(code)


class _Skips:
    """Counts tests that were skipped: they would not die."""

    count = 0

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.count += report.skipped


def _run_all(mutants: Sequence[Mutant], folder: Path, workers: int, *, verbose: bool) -> list[str]:
    """Run the tests without and with each change; return what is wrong."""
    os.chdir(ROOT)
    for library in _LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(library)
    by_file: dict[str, list[str]] = defaultdict(list)
    for test in sorted({test for mutant in mutants for test in mutant.tests}):
        by_file[test.partition("::")[0]].append(f"tests/{test}")
    unchanged = [_Run(file, tests, folder / f"unchanged-{n}") for n, (file, tests) in enumerate(by_file.items())]
    why = "a named test is not there, skipped, or fails without a change"
    failed = [f"{run.name}: {why}\n{run.output}" for run in _in_parallel(unchanged, workers) if run.code]
    if failed:
        return failed
    broken = [
        _Run(mutant.guard, [f"tests/{test}" for test in mutant.tests], folder / str(number), mutant)
        for number, mutant in enumerate(mutants)
    ]
    for run in _in_parallel(broken, workers):
        assert run.mutant is not None
        is_dead = run.code == pytest.ExitCode.TESTS_FAILED
        result = "dies" if is_dead else "SURVIVES" if run.code == 0 else "is not a mutant"
        print(f"{result:8} {run.took_s:4.1f} s  {run.mutant.file}: {run.name}", flush=True)
        if verbose and is_dead:
            print(f"{'':17}{run.error}")
        if not is_dead:
            why = f"\n{run.output}" if run.code else f" ({', '.join(run.tests)})"
            failed.append(f"{result}: {run.mutant.file}: {run.name}{why}")
    return failed


def _in_parallel(runs: Sequence[_Run], workers: int) -> Iterator[_Run]:
    """Yield each run when it has ended."""
    waiting, running = list(reversed(runs)), dict[int, tuple[_Run, float]]()
    while waiting or running:
        while waiting and len(running) < workers:
            run = waiting.pop()
            run.folder.mkdir()
            running[_forked(run.work)] = run, time.monotonic()
        for pid, (run, began_s) in list(running.items()):
            done, status = os.waitpid(pid, os.WNOHANG)
            run.took_s = time.monotonic() - began_s
            if done:
                run.code = os.waitstatus_to_exitcode(status)
                del running[pid]
                yield run
            elif run.took_s > _LONGEST_S:
                os.kill(pid, signal.SIGKILL)
        time.sleep(_LOOK_S)


def _forked(work: Callable[[], None]) -> int:
    sys.stdout.flush()
    pid = os.fork()
    if pid == 0:
        work()
    return pid


def _link(tree: Path, mutant: Mutant | None) -> None:
    """Make a folder with the package, of links, but for the changed file."""
    tree.mkdir()
    parts = Path(mutant.file).parts if mutant else ()
    here, there = SOURCES, tree / SOURCES.name
    for part in parts:
        there.mkdir()
        for each in here.iterdir():
            if each.name not in (part, "__pycache__"):
                (there / each.name).symlink_to(each)
        here, there = here / part, there / part
    if mutant is None:
        there.symlink_to(here)
    else:
        there.write_text(mutant.source.replace(mutant.find, mutant.replace), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
