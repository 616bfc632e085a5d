"""Weigh the mount and export it."""
