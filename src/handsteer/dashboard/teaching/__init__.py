"""Teaches signs on the page: one lesson at a time, given by who drives; the teaching itself is handsteer.signs.teaching."""
