"""One file for colleagues who have no Python."""
