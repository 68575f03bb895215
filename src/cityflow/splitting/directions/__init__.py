"""Principal directions of a block (Dahlke et al. 2017)."""
