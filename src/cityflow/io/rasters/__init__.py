"""Rasters: files, and the Zarr group of a run."""
