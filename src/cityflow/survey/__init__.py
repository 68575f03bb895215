"""What the driver knows of a city while it is made: names and digests, no data. Tasks are built from it."""
