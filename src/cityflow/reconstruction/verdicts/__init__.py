"""Expected quality of a model: points held back from the fit, points that are no roof, and the verdict."""
