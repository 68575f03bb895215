"""Ground control points of other programs: one file per format."""
