"""State of a city in the driver: names and digests, no data. Tasks are built from it."""
