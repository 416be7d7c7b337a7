"""One module for each verb of the depth_person command."""
