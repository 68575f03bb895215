"""Placement of patches on the pages of a texture atlas."""
