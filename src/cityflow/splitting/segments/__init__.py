"""Line segments of images, heights and LiDAR points."""
