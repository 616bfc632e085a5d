"""The fold bracket: where it stands, its solid, and its joint where it is made in halves."""
