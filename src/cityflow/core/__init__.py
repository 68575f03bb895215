"""Values: points, grids and tiles, planes, polyhedra, buildings. No files, no Dask."""
