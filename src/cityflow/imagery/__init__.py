"""What pixels say: raw frames, radiometry, colour. Arrays and values in, arrays and values out."""
