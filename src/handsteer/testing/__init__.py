"""Fakes for tests: cameras with faults, and helpers to run a graph step by step."""
