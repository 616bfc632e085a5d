"""Begin, check and describe rig files."""
