"""Textures: which images show a face, what stands between, and the pixels that make it up."""
