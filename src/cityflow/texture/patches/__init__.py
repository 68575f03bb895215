"""The pixels of a face: from its root image as they are, from other images where something stands between, and straight from the front."""
