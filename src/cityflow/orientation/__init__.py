"""Where images look: footprints, look directions, which images see what together. Arrays and values in, arrays and values out."""
