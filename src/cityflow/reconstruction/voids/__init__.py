"""Voids in a model and bodies that stand out of it, where points show them: arcades, passages, stilts, loggias, bay windows."""
