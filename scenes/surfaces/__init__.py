"""Surfaces as triangles: shapes, noise, patches and branching growth, from which worlds and targets are made."""
