"""What is computed in every frame: paths through port and mirrors, shading, veiling light."""
