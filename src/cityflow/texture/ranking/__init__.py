"""Selection and order of the images of a face."""
