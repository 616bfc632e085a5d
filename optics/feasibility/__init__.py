"""What a rig must satisfy to work, by its numbers alone."""
