"""Windows and doors, from the textures of façades (Frommholz 2017, section 6)."""
