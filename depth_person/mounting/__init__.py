"""Where the camera is and how it looks, at the time of an image, from what a vehicle tells."""
