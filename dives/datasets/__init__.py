"""Data sets: many images with their ground truth, each of them known by its number alone."""
