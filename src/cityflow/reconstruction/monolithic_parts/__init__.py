"""Pieces of the monolithic method: cells of façades and roofs, their topology, and the geometry that follows from it."""
