"""Visibility of a face in images: rays against the surface and the surrounding models."""
