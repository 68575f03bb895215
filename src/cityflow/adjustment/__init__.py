"""Orientation from the images themselves: features, ties between images, and their adjustment. Arrays and values in and out."""
