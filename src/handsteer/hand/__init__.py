"""The kinematic hand: joints, angles, poses of the signs, and rendered pictures."""
