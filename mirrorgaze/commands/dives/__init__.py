"""Dive in simulation, track recorded or live images, and evaluate both."""
