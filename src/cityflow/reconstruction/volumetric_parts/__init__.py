"""Pieces of the volumetric method: surfaces from cubes, nodes and edges, columns, hull."""
