"""Exterior and interior orientations of other programs: one file per format."""
