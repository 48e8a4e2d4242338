"""Teaches signs on the page: one lesson at a time, which is given by who drives."""
