"""Figures: results in, images out."""
