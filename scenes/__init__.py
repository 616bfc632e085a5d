"""Appearance: rig and world as a scene under water, rendered as the camera sees it through port and mirrors."""
