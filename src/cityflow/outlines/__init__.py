"""Building outlines: found in an nDSM, or given ones cleaned and noded."""
