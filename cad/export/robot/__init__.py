"""The mount as a robot model: URDF and SDF with their meshes."""
