"""Candidate lines and borders from LiDAR points."""
