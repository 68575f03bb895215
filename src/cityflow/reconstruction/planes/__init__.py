"""Roof planes in a cloud of points."""
