"""Outlines that somebody gives: cleaned, or drawn by a person."""
