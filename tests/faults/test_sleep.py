"""A machine that sleeps, as a laptop whose lid is closed: all its processes stand, and so does its monotonic clock."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux" or shutil.which("cc") is None, reason="needs Linux and a C compiler"),
]

# Between a process and its system: sleep_for() stops the process, after which CLOCK_MONOTONIC shows the time of before.
SLEEP = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <semaphore.h>
#include <time.h>
#include <unistd.h>

#define SYSTEM(name) ((typeof(&name)) dlsym(RTLD_NEXT, #name))

static volatile long slept_s;

int clock_gettime(clockid_t kind, struct timespec *now) {
    int failed = SYSTEM(clock_gettime)(kind, now);
    if (!failed && kind == CLOCK_MONOTONIC) now->tv_sec -= slept_s;
    return failed;
}

static struct timespec of_the_system(clockid_t kind, const struct timespec *until) {
    struct timespec theirs = *until;
    if (kind == CLOCK_MONOTONIC) theirs.tv_sec += slept_s;
    return theirs;
}

int clock_nanosleep(clockid_t kind, int flags, const struct timespec *until, struct timespec *left) {
    struct timespec theirs = of_the_system(kind, until);
    return SYSTEM(clock_nanosleep)(kind, flags, flags & TIMER_ABSTIME ? &theirs : until, left);
}

int sem_clockwait(sem_t *semaphore, clockid_t kind, const struct timespec *until) {
    struct timespec theirs = of_the_system(kind, until);
    return SYSTEM(sem_clockwait)(semaphore, kind, &theirs);
}

void sleep_for(unsigned seconds) {
    sleep(seconds);
    slept_s += seconds;
}
"""

CLOCK = """
import ctypes, sys
from handsteer.clock import RealClock

clock = RealClock()
before_s = clock.now()
ctypes.CDLL(sys.argv[1]).sleep_for(1)
print(clock.now() - before_s)
"""

DRIVE = r"""
import ctypes, sys, time
from handsteer.config import Config, VirtualHandConfig
from handsteer.graph import Graph

with Graph(Config(virtual_hand=VirtualHandConfig(script="Stop:2 Forward:600"))) as graph:
    graph.start()
    while graph.robot.state.linear_mps < 0.2:
        time.sleep(0.02)
    ctypes.PyDLL(sys.argv[1]).sleep_for(3)  # holds the interpreter's lock: all threads of Python stand
    time.sleep(1.0)  # for braking
    fastest = 0.0
    for _ in range(100):
        time.sleep(0.02)
        fastest = max(fastest, abs(graph.robot.state.linear_mps))
    print(fastest)
"""


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """SLEEP, compiled."""
    source, library = tmp_path / "sleep.c", tmp_path / "sleep.so"
    source.write_text(SLEEP)
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
    return library


def run(program: str, library: Path) -> float:
    """Return the number that a program prints whose sleep is that of the library."""
    command = [sys.executable, "-c", program, str(library)]
    environment = {**os.environ, "LD_PRELOAD": str(library)}
    done = subprocess.run(
        command, env=environment, cwd=library.parent, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    return float(done.stdout)


def test_time_in_which_the_machine_sleeps_counts(library: Path) -> None:
    assert run(CLOCK, library) >= 1.0


def test_after_a_sleep_neutral_has_to_be_seen(library: Path) -> None:
    assert run(DRIVE, library) < 0.001
