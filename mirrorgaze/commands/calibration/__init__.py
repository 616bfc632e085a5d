"""Calibrate a built rig, and a camera through its port."""
