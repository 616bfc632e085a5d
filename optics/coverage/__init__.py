"""What is seen, from which joint values, and what blocks it: usable field of view and coverage of the sphere."""
