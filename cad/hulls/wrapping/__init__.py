"""A closed solid around triangles of any kind: found on a grid, then drawn back onto them."""
