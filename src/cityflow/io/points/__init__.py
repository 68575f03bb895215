"""Points: LAS and LAZ, and the index of a survey."""
