"""Where the target is estimated to be: the Kalman filter, in the crop (the paper) and among directions."""
