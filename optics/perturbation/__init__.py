"""A rig that is not nominal: its parameters, the perturbed train, and the derivatives of what it shows."""
