"""Exterior and interior orientations as other programs write them: a file a format."""
