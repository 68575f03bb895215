"""Export formats of a ground tile: one file per format."""
