"""What images really see of a face: rays past the surface and past the models that stand around."""
