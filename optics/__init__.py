"""Light as mathematics on arrays: cameras, ports, mirrors, the optical train, gaze kinematics, water."""
