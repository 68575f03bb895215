"""Roof types of Hron 2020: lines in orthos, their categories, parts of an outline, skeletons, heights, solids."""
