"""Following a target over the mirrors as a task for learning: episodes of a dive, what an agent sees and may do."""
