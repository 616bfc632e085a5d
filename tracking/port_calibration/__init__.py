"""Calibration of any camera behind a flat or dome port, and of several of them, from images of a board."""
