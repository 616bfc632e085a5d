"""Calibration in simulation: boards and mirror edges observed by a rendered or synthetic camera."""
