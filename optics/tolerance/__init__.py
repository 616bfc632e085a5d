"""The errors of a built rig, and which tolerance matters most."""
