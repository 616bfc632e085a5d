"""The loop: finding the target in the gaze mirror's picture, and turning the mirror after it."""
