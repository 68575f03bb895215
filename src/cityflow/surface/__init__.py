"""Points to DSM, DTM, nDSM, vegetation: arrays in, arrays out."""
