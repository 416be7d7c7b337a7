"""Frames in: sources, intrinsics, calibration."""
