"""The tracking loop: behaviour, variants, and the loop on a recorded or live video."""
