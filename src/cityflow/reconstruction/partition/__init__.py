"""The outline cut into roof polygons, each on its plane."""
