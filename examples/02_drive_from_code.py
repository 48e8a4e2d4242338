"""Run the whole graph from Python, faster than real time, and print where the robot ends."""

from handsteer.clock import SteppedClock
from handsteer.config import CameraConfig, Config, ControlConfig, VirtualHandConfig
from handsteer.graph import Graph


def main() -> None:
    config = Config(
        camera=CameraConfig(source="virtual", width=320, height=240),
        virtual_hand=VirtualHandConfig(script="Forward:2 Go:1 Turn Left:1 Stop:1"),
        control=ControlConfig(max_linear=0.5, max_angular=1.0),
    )
    with Graph(config, SteppedClock()) as graph:
        graph.run_stepped(5.0)
    summary = graph.summary()
    print(f"signs: {summary.signs}")
    if pose := summary.final_pose:
        print(f"the robot is at x {pose.x:.2f} m, y {pose.y:.2f} m")


if __name__ == "__main__":
    main()
