"""Borders by a fitted model: features of the stations of a strip, their odds, and the joint choice over a row."""
