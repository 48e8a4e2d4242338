"""Headless Chromium for the browser tests and the README's pictures."""

import ctypes
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Playwright, sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome")
_SHELL = "chromium-headless-shell"

_FLAGS = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    # WebGL in software; the page around it as without a graphics card, else it too is drawn by WebGL's means, which
    # takes half a processor more while the robot drives.
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
)
_PR_CAPBSET_DROP, _CAP_SYS_NICE = 24, 23


def find(*, shell: bool = False) -> str | None:
    """Return the path of Chromium on this machine; None if it is not installed.

    Args:
        shell: Whether its shell without windows is preferred. That draws the same pages with half the processor, but
            does not keep the answer of a person who allows a camera.
    """
    names = (_SHELL, *NAMES) if shell else (*NAMES, _SHELL)
    return next((path for name in names if (path := shutil.which(name))), None)


@contextmanager
def playwright() -> Iterator[Playwright]:
    """Give Playwright, of which :func:`launch` starts Chromium.

    As root, Chromium raises the priority of its rendering, which takes all processors here, above the graph's; what
    Playwright starts may not.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_CAPBSET_DROP, _CAP_SYS_NICE)
    with sync_playwright() as started:
        yield started


def launch(playwright: Playwright, webcam: Path | None = None, *, sparing: bool = False) -> Browser:
    """Return a Chromium with a fresh profile and software WebGL.

    Args:
        playwright: What :func:`playwright` gives.
        webcam: Motion JPEG file (``.mjpeg``) that its webcam plays in a loop; no webcam without it.
        sparing: Whether little of the processor is taken: WebGL smooths no edges, and the shell is preferred, but for a
            webcam.

    Raises:
        FileNotFoundError: It is not installed.
    """
    path = find(shell=sparing and webcam is None)
    if path is None:
        raise FileNotFoundError(f"no browser found: install one of {', '.join(NAMES)}")
    flags = [*_FLAGS, *(("--webgl-antialiasing-mode=none",) if sparing else ())]
    if webcam is not None:
        flags += ["--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream"]
        flags += [f"--use-file-for-fake-video-capture={webcam}"]
    return playwright.chromium.launch(executable_path=path, args=flags)
