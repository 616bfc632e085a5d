"""What a port does to a camera: focus, colour fringes and distortion."""
