"""Where the target is believed to be: the Kalman filter, in the crop (the paper) and among directions."""
