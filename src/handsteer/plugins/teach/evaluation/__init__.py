"""Measures how well signs are recognised in labelled photos, landmarks and videos."""
