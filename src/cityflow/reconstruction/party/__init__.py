"""Party walls: walls shared by neighbours."""
