"""Whether the parts clear each other over all joint values."""
