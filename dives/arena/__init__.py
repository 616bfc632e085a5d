"""The arena: dives that nobody wrote, drawn from a stated distribution, and what a loop makes of them."""
