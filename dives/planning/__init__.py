"""What can be said of a dive before anything is rendered: where its target is, and what shows it."""
