"""The mount put together, and its meshes."""
