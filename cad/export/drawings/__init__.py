"""Drawings for the workshop: parts, assembly, exploded view."""
