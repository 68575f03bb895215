"""From an oriented flight or a LiDAR survey to a valid LoD2 city model, on Dask."""

__version__ = "0.1.0"
