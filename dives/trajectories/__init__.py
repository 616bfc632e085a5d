"""What a dive file says of motion, section by section, paths from files, and a sensor of the attitude."""
