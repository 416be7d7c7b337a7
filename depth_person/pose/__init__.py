"""A frame to people: networks, the skeleton layout, tracking."""
