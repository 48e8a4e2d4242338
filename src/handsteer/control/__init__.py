"""Sign control and safety as pure functions and ``step(input, dt)`` classes, without clock or I/O."""
