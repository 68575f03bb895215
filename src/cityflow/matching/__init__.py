"""Dense matching: rectification, semi-global matching from coarse to fine, merging, depth maps. Arrays and values in, arrays and values out."""
