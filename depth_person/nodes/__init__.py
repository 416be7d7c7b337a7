"""ROS 2 nodes: thin shells over the camera, pose and distance stages."""
