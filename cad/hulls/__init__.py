"""Hulls: parametric shapes, files of others, and where the mount is anchored on them."""
