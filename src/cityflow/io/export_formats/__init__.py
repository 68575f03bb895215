"""What is written of a ground tile: a file a format."""
