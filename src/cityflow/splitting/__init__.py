"""A complex of houses becomes single units: line segments, principal directions, gaps, cut lines (Dahlke 2017)."""
