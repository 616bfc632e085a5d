"""Gaze, virtual camera, port and water."""
