"""What speaks for a candidate line: heights, roofs, colours, façades, repetition."""
