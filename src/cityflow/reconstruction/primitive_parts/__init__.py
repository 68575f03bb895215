"""Shapes of few numbers over parts of an outline: fits, cuts between parts, roof planes."""
