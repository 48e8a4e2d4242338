"""Recognition on an emulated 64-bit ARM processor."""
