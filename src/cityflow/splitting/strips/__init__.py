"""Strips and slices along candidate lines, and what they show."""
