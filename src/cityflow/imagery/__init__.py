"""Pixel values: raw images, radiometry, colour. Arrays and values in, arrays and values out."""
