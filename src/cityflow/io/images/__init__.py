"""Photographs: headers, tiled pyramids, reading by window, writing."""
