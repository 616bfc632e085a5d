"""Where the mirrors look: kinematics, Jacobian and motion of the gaze, and the view as a virtual pinhole camera."""
