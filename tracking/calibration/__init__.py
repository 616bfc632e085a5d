"""Calibration: the perturbations of a built rig, found from images of a board or of the gaze mirror's own corners."""
