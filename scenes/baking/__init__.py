"""Light that is found once per world, sun and robot, and kept."""
