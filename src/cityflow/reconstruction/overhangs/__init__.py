"""Roof overhangs, and solids with them."""
