"""How far a built rig is off, and which tolerance matters most."""
