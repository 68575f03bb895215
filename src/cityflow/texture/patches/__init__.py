"""The pixels of a face: copied from its root image, completed from other images, and rectified."""
