"""What a dive file says of motion, section by section, and paths that are read from files."""
