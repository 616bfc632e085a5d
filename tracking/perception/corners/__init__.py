"""Corners of the gaze mirror in the image: the exact train's, or the paper's eq. 6 on samples of them."""
