"""Print plates as 3MF, and their slices."""
