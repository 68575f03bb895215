"""Splits a building complex into single units: line segments, principal directions, gaps, cut lines (Dahlke 2017)."""
