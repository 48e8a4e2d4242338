"""A cable between two network namespaces that delays, drops and cuts: a relay between two TAP devices.

It stands in for ``tc netem`` where the kernel has none. Run as root: ``relay.py NAMESPACE DEVICE NAMESPACE DEVICE``
makes a device in each namespace and relays Ethernet frames between them, until its input ends; then both devices are
gone. It reads orders as lines of JSON and answers each by one line: ``shape`` (delay_s, jitter_s, loss) is for both
directions, and with ``cut_off``, 0 or 1, nothing comes to that end; the answer says when it was done, in Unix time, and
how many frames have been dropped.
"""

import contextlib
import fcntl
import heapq
import json
import os
import random
import select
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

TUNSETIFF = 0x400454CA
IFF_TAP, IFF_NO_PI = 0x0002, 0x1000
LONGEST_FRAME = 65536
MOST_WAITING = 20_000
IDLE_S = 1.0
AT_ONCE = 64


class Wire:
    """Frames on their way, whichever way.

    Args:
        draw: Returns a random number from 0 to 1.

    Attributes:
        delay_s: How long a frame takes at least, but for the jitter.
        jitter_s: The time is evenly spread over ``delay_s`` ± this; never less than 0. Frames may overtake others.
        loss: Which share of the frames is lost, 0 to 1; at 1 the cable is cut, also for what is under way.
        cut_off: The end to which nothing comes, if the cable is cut in one direction.
        dropped: How many frames were lost.
    """

    def __init__(self, draw: Callable[[], float] = random.random) -> None:
        self._draw = draw
        self._waiting: list[tuple[float, int, int, bytes]] = []
        self._number = 0
        self.delay_s = self.jitter_s = self.loss = 0.0
        self.cut_off: int | None = None
        self.dropped = 0

    def shape(self, delay_s: float = 0.0, jitter_s: float = 0.0, loss: float = 0.0) -> None:
        """Set how frames travel from now on."""
        self.delay_s, self.jitter_s, self.loss = delay_s, jitter_s, loss
        if loss >= 1:
            self.dropped += len(self._waiting)
            self._waiting.clear()

    def put(self, frame: bytes, end: int, now_s: float) -> None:
        """Let ``frame`` go to the given end; as a real queue does, this one drops what is too much."""
        if end == self.cut_off or len(self._waiting) >= MOST_WAITING or self._draw() < self.loss:
            self.dropped += 1
            return
        due_s = now_s + max(0.0, self.delay_s + (2 * self._draw() - 1) * self.jitter_s)
        heapq.heappush(self._waiting, (due_s, self._number, end, frame))
        self._number += 1

    def arrived(self, now_s: float) -> Iterator[tuple[int, bytes]]:
        """Take out the frames that have arrived, with their ends, in the order of their arrival."""
        while self._waiting and self._waiting[0][0] <= now_s:
            _, _, end, frame = heapq.heappop(self._waiting)
            yield end, frame

    def next_s(self) -> float | None:
        """Return when the next frame arrives; None when none is under way."""
        return self._waiting[0][0] if self._waiting else None


def open_tap(namespace: str, device: str, number: int) -> int:
    """Make a TAP device in a namespace; return the descriptor to which its frames come."""
    name = f"hs{os.getpid() % 1_000_000}-{number}"
    descriptor = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(descriptor, TUNSETIFF, struct.pack("16sH", name.encode(), IFF_TAP | IFF_NO_PI))
    subprocess.run(["ip", "link", "set", name, "netns", namespace, "name", device], check=True)
    return descriptor


def relay(ends: list[int], orders: int, serve: Callable[[str], None], wire: Wire) -> None:
    """Relay frames between two ends, and serve the lines that come from ``orders`` until it ends."""
    text = b""
    while True:
        next_s = wire.next_s()
        wait_s = IDLE_S if next_s is None else max(0.0, next_s - time.monotonic())
        for ready in select.select([*ends, orders], [], [], wait_s)[0]:
            if ready == orders:
                read = os.read(orders, LONGEST_FRAME)
                if not read:
                    return
                *lines, text = (text + read).split(b"\n")
                for line in lines:
                    serve(line.decode())
            else:
                take_in(ready, ends[1 - ends.index(ready)], wire)
        for end, frame in wire.arrived(time.monotonic()):
            with contextlib.suppress(OSError):  # a device that is full; a cable would lose the frame likewise
                os.write(end, frame)


def take_in(source: int, target: int, wire: Wire) -> None:
    for _ in range(AT_ONCE):
        try:
            frame = os.read(source, LONGEST_FRAME)
        except BlockingIOError:
            return
        wire.put(frame, target, time.monotonic())


def main() -> None:
    """Relay as the command line says."""
    words = sys.argv[1:]
    wire = Wire()
    ends = [open_tap(words[number], words[number + 1], number) for number in (0, 2)]

    def serve(line: str) -> None:
        order: dict[str, Any] = json.loads(line)
        assert order.pop("order") == "shape", line
        cut_off = order.pop("cut_off", None)
        wire.cut_off = None if cut_off is None else ends[cut_off]
        wire.shape(**order)
        print(json.dumps({"at_s": time.time(), "dropped": wire.dropped}), flush=True)

    print("ready", flush=True)
    relay(ends, sys.stdin.fileno(), serve, wire)


if __name__ == "__main__":
    assert Path("/dev/net/tun").exists(), "there is no /dev/net/tun"
    main()
