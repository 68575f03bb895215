"""What images themselves say of outlines, where the surface that was matched from them is wrong."""
