"""Which images look at a face, how, and in what order they are to be taken."""
