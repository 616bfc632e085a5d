"""What a rig's meshes hide and leave of the camera's view, computed beforehand and handed to the loop as arrays."""
