"""Workflows that compute results and have them reported: design, search, mount export, calibration."""
