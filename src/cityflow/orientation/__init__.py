"""Viewing geometry: footprints, look directions, pairs of images. Arrays and values in, arrays and values out."""
