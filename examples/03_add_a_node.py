"""Add your own node, which subscribes to the signs and the odometry."""

from handsteer.clock import SteppedClock
from handsteer.config import CameraConfig, Config, VirtualHandConfig
from handsteer.graph import Graph
from handsteer.messages import HAND_SIGN, ODOM, Odometry, String
from handsteer.nodes.base import Node
from handsteer.transports.base import Received


class Reporter(Node):
    """Prints each change of sign, with the speed at that moment."""

    def __init__(self, graph: Graph) -> None:
        super().__init__("reporter", graph.transport, graph.clock)
        self._sign = ""
        self._speed_mps = 0.0
        self.subscribe(ODOM, self._on_odometry)
        self.subscribe(HAND_SIGN, self._on_sign)

    def _on_odometry(self, received: Received[Odometry]) -> None:
        self._speed_mps = received.message.twist.twist.linear.x

    def _on_sign(self, received: Received[String]) -> None:
        if received.message.data != self._sign:
            self._sign = received.message.data
            print(f"{self.clock.now():5.2f} s  {self._sign:10s} at {self._speed_mps:.2f} m/s")


def main() -> None:
    script = VirtualHandConfig(script="Forward:1.5 Go:1 Backward:1 Stop:1")
    config = Config(camera=CameraConfig(source="virtual", width=320, height=240), virtual_hand=script)
    with Graph(config, SteppedClock()) as graph:
        graph.add(Reporter(graph))
        graph.run_stepped(4.5)


if __name__ == "__main__":
    main()
