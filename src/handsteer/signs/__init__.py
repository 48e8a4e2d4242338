"""Recognises signs from 21 hand landmarks."""
