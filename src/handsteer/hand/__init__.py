"""The kinematic hand: joints, angles, poses of the signs, and pictures of it."""
