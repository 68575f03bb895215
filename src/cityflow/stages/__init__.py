"""One short file per stage: read the unit's inputs, call algorithms, write its outputs."""
