"""From 21 landmarks to the name of a sign."""
