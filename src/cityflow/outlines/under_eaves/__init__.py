"""Walls that stand inside an outline which is the roof's rim."""
