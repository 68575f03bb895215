"""Adds common vertices to the common boundaries of neighbouring outlines."""
