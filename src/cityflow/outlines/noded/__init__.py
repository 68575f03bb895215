"""Neighbouring outlines with their common boundaries in common."""
