"""Teaches signs on the page: one lesson at a time, run by the driver."""
