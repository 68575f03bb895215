"""Tables and layers: outlines, edits, points of known position."""
