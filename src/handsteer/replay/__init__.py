"""Runs recordings through today's software, compares the results with the recorded ones, and reports on a drive."""
