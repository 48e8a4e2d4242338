"""From signs to safe velocities: pure `step(input, dt)`, no clock, no I/O."""
