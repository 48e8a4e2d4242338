"""Drive by signs in your own program: images in, velocities out, without nodes or ROS.

Run ``python examples/05_teleop_in_your_program.py``; replace the virtual hand by your camera, and the position by your
robot.
"""

import math

from handsteer import Config, Teleop
from handsteer.clock import SteppedClock
from handsteer.config import VirtualHandConfig
from handsteer.plugins.virtual_hand.camera import VirtualHandCamera

FPS = 30
SCRIPT = VirtualHandConfig(script="Stop:0.7 Go:0.6 Stop:0.7 Forward:2 Go:1 Turn Left:1 Stop:1")


def main() -> None:
    teleop, clock = Teleop(Config()), SteppedClock()
    camera = VirtualHandCamera(SCRIPT, width=320, height=240, fps=FPS, clock=clock)
    x = y = yaw = 0.0
    for frame in range(7 * FPS):
        clock.advance(1 / FPS)
        velocity = teleop.step(camera.read().image, 1 / FPS)
        yaw += velocity.angular_radps / FPS
        x += velocity.linear_mps * math.cos(yaw) / FPS
        y += velocity.linear_mps * math.sin(yaw) / FPS
        if frame % FPS == 0:
            print(f"{velocity.linear_mps:.2f} m/s, {velocity.angular_radps:.2f} rad/s: {teleop.reason}")
    print(f"the robot is at x {x:.2f} m, y {y:.2f} m")


if __name__ == "__main__":
    main()
