"""Walls that neighbours share."""
