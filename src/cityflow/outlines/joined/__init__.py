"""Wall footprints from walls and roofs together."""
