"""Designs that no other beats."""
