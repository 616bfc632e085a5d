"""A design search into a folder, and what it found."""
