"""What a mount weighs, displaces and has to bear, from its meshes: hydrostatics, drag, servo torque, stiffness."""
