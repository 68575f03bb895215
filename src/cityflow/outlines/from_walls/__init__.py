"""Walls in plan from points on façades (Nex 2013)."""
