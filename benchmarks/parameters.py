"""How soon ``ros2 param`` gets its answers from a node of ours, on a real ROS 2 with Fast DDS, and what waiting costs.

Run ``make ros2`` once, then ``python benchmarks/parameters.py``.
"""

import argparse
import os
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the ROS 2 node that the tests use

from tests.ros2.graph import ros2_graph

from handsteer.config import Config
from handsteer.parameters import NodeParameters
from handsteer.transports import join

NODE = "/answering"
THREAD = "rtps"


def cpu_s() -> float:
    """Return the processor time of the thread that answers Fast DDS, in seconds."""
    (thread,) = [thread for thread in threading.enumerate() if thread.name == THREAD]
    words = Path(f"/proc/self/task/{thread.native_id}/stat").read_text(encoding="ascii").rpartition(") ")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def line(name: str, times_s: list[float]) -> str:
    took_ms = 1000 * np.array(times_s)
    percentile = f"p99 {np.percentile(took_ms, 99):7.2f} ms, longest {took_ms.max():7.2f} ms"
    return f"  {name:46s} median {np.median(took_ms):7.2f} ms, {percentile}"


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure the parameter services on a real ROS 2.")
    parser.add_argument("--calls", type=int, default=50, help="calls of one client")
    parser.add_argument("--clients", type=int, default=100, help="clients, one after the other")
    parser.add_argument("--idle", type=float, default=20.0, help="seconds without a call")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as home, ros2_graph(Path(home)) as graph:
        os.environ.update({name: value for name, value in graph.env.items() if name.startswith("ROS_")})
        session = join("dds", NODE[1:], [])
        session.serve(NodeParameters(Config(), "control", lambda _: None))
        print(f"rclpy on Fast DDS asks; load before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        names = graph.peer.ask("parameters", node=NODE, call="list_parameters", arguments=[])["result"]["names"]
        calls = graph.peer.ask("timed_calls", node=NODE, count=options.calls)
        print(line(f"{options.calls} calls of list_parameters", calls))
        before_s, began_s = cpu_s(), time.monotonic()
        time.sleep(options.idle)
        share = (cpu_s() - before_s) / (time.monotonic() - began_s)
        print(f"  {'idle, with one ROS 2 node about':46s} {100 * share:.2f} % of a core")
        fresh = graph.peer.ask("fresh_clients", node=NODE, count=options.clients)
        answered = sum(found == len(names) for found, _ in fresh)
        print(
            line(f"{answered} of {len(fresh)} new clients answered, from their start", [took_s for _, took_s in fresh])
        )
        session.close()


if __name__ == "__main__":
    main()
