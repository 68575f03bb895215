"""Reconstruction of one building: from points and outline to a closed hull."""
