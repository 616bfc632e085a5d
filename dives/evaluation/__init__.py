"""Evaluations of parts of the loop: detector, redetection, tracking rate."""
