"""Turning the gaze mirror: the paper's law in the crop, pointing in gaze space, paths for the search."""
