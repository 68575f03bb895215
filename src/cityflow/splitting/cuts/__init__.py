"""Candidate lines as chords of an outline, gaps, and the lines that are taken."""
