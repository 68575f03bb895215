"""Closed solids from roof polygons."""
