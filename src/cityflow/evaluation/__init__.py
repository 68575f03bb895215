"""Metrics against truth or reference, in metres."""
