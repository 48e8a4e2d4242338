"""What programs that look at the topics (``--foxglove``) cost, and what they do to the latency of driving.

Run ``python benchmarks/foxglove.py``. The whole graph runs in this process with the virtual hand, at 640x480 and 30
frames per second, and the server in its own process as always. Simple clients receive everything and decode nothing, in
processes of the lowest priority, because those of people are often on other processors. Rounds with different clients
alternate, so that a busy machine slows all alike.
"""

import argparse
import asyncio
import json
import os
import statistics
import subprocess
import sys
import time

import numpy as np
import websockets
from _measuring import cpu_s

from handsteer.config import FoxgloveConfig, load
from handsteer.graph import Graph
from handsteer.messages import CMD_VEL, Twist
from handsteer.plugins.foxglove.process import LiveProcess
from handsteer.transports.base import Received

SETTLED_S = 1.5
RAW = ("/image_raw", "/gesture/image_annotated")
ROUNDS = {"none": (0, ()), "one, no raw pictures": (1, RAW), "one, all topics": (1, ()), "three, all topics": (3, ())}
"""Number of clients, and the topics that they leave out, by the name of the round."""


async def look(address: str, without: list[str]) -> None:
    """Receive everything until this process is killed; print a line when it begins."""
    protocol = websockets.Subprotocol("foxglove.sdk.v1")
    async with websockets.connect(address, subprotocols=[protocol], max_size=None, compression=None) as socket:
        await socket.recv()
        channels = json.loads(await socket.recv())["channels"]
        wanted = [{"id": each["id"], "channelId": each["id"]} for each in channels if each["topic"] not in without]
        await socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        await socket.recv()
        print("receives", flush=True)
        async for _ in socket:
            pass


def measure(name: str, address: str, live: int, latencies: list[float], duration_s: float) -> np.ndarray:
    """Return % of a core of the graph and of the server, and median and 99th percentile of the latency in ms."""
    count, without = ROUNDS[name]
    command = ["nice", "-n", "19", sys.executable, __file__, "--look", address, *without]
    clients = [subprocess.Popen(command, stdout=subprocess.PIPE) for _ in range(count)]
    try:
        for client in clients:
            assert client.stdout is not None
            client.stdout.readline()
        time.sleep(SETTLED_S)
        began_s, before = time.monotonic(), (cpu_s(os.getpid()), cpu_s(live))
        latencies.clear()
        time.sleep(duration_s)
        taken_s = time.monotonic() - began_s
        spent = [
            100 * (cpu_s(pid) - spent_s) / taken_s for pid, spent_s in zip((os.getpid(), live), before, strict=True)
        ]
        times = np.array(latencies) * 1000
        return np.array([*spent, np.median(times), np.percentile(times, 99), len(times) / taken_s])
    finally:
        for client in clients:
            client.kill()
            client.wait()


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description="Measure what programs that look at the topics cost.")
    parser.add_argument("--look", nargs="+", help=argparse.SUPPRESS)
    parser.add_argument("--duration", type=float, default=8.0, help="seconds of each round")
    parser.add_argument("--times", type=int, default=4, help="how often each round is repeated")
    options = parser.parse_args()
    if options.look:
        asyncio.run(look(options.look[0], options.look[1:]))
        return
    latencies: list[float] = []
    results: dict[str, list[np.ndarray]] = {name: [] for name in ROUNDS}
    with Graph(load(base={"camera": {"source": "virtual"}})) as graph:
        live = LiveProcess()
        try:
            address = live.serve(graph.transport, graph.clock, graph.topics, FoxgloveConfig(port=0))

            def on_twist(received: Received[Twist]) -> None:
                if received.captured_s is not None:
                    latencies.append(graph.clock.now() - received.captured_s)

            graph.transport.subscribe("benchmark", CMD_VEL, on_twist)
            graph.start()
            time.sleep(SETTLED_S)
            for _ in range(options.times):
                for name, found in results.items():
                    found.append(measure(name, address, live.process.pid, latencies, options.duration))
        finally:
            live.stop()
    print("clients                 graph    server   capture to Twist: median      p99   commands/s")
    for name, found in results.items():
        graph_cpu, server_cpu, median, p99, rate = (statistics.median(row[k] for row in found) for k in range(5))
        print(f"{name:21s} {graph_cpu:5.1f} % {server_cpu:7.1f} % {median:21.1f} ms {p99:8.1f} ms {rate:9.1f}")


if __name__ == "__main__":
    main()
