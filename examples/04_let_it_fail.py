"""Test what the robot does when something fails: the whole graph in stepped time, on a transport with injected faults.

Run ``python examples/04_let_it_fail.py``. Put your own nodes on the same transport to see what they do.
"""

from typing import Any

from handsteer.clock import SteppedClock
from handsteer.config import load
from handsteer.graph import Graph
from handsteer.messages import CMD_VEL, HAND_SIGN, IMAGE_RAW, Topic
from handsteer.testing import Trace
from handsteer.testing.fault_transport import CUT, FROZEN, FaultTransport, LinkFault
from handsteer.transports.in_process import InProcessTransport

SETTINGS = {
    "camera": {"source": "virtual", "width": 320, "height": 240, "fps": 15},
    "virtual_hand": {"script": "NONE:2 Forward:600"},
    "robot": {"world": "empty"},
    "control": {"arming": "on", "linear_step": 0.05, "max_linear": 0.3},
}
FAULTS: dict[str, tuple[Topic[Any], LinkFault]] = {
    "no pictures arrive": (IMAGE_RAW, CUT),
    "signs are frozen": (HAND_SIGN, FROZEN),
    "a fifth of the commands is lost": (CMD_VEL, LinkFault(drop=0.2)),
}


def main() -> None:
    for name, (topic, fault) in FAULTS.items():
        clock = SteppedClock()
        transport = FaultTransport(InProcessTransport(), clock, seed=1)
        with Graph(load(None, None, SETTINGS), clock, transport) as graph:
            graph.add(transport.wire)
            graph.run_stepped(4.0)
            trace = Trace(graph)
            before_m = graph.robot.state.truth.x
            transport.spoil(topic, fault)
            graph.run_stepped(2.0)
            transport.heal(topic)
            graph.run_stepped(1.0)
            moved_m = graph.robot.state.truth.x - before_m
            drives_on = any(command != (0.0, 0.0) for command in trace.commands[-10:])
            print(f"{name} for 2 s: the robot {'drives on' if drives_on else 'stops'}, {moved_m:.2f} m further")


if __name__ == "__main__":
    main()
