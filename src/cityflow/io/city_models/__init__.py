"""City models in each export format, and their textures, openings and attributes."""
