"""Noise filter of a point cloud."""
