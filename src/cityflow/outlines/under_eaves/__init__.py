"""Walls inside an outline that is the rim of a roof."""
