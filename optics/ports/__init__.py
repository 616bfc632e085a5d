"""Windows of the housing: flat and dome ports."""
