"""Helpers for tests: cameras and a transport that fail on request, and a record of a graph's commands."""
