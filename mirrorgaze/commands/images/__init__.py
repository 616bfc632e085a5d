"""Render images, and compare them with the reference."""
