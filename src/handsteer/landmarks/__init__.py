"""From a frame to the 21 landmarks of a hand."""
