"""Drivers of the gaze mirror: simulated servos, recorded joints, a servo controller on a serial port."""
