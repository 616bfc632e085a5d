"""What other programs write about a robot's shape, read as triangles: nothing is repaired here, and nothing guessed."""
