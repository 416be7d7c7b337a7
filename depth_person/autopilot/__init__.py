"""What autopilots take: people as obstacles and as a target; free of ROS."""
