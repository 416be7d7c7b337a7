"""What users can set: the parameters of every node, free of ROS."""
