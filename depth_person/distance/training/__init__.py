"""Trains the skeleton estimator's network on bodies of our own making; not needed at run time."""
