"""What is driven: a simulated robot, or one behind a topic."""
