"""Outlines from a surface: building regions and their shapes (Gross 2005)."""
