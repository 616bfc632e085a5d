"""The description of a scene: world, water, sun, target, and the state of the robot in it."""
