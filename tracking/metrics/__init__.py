"""What a dive's log says about the loop: how well it held the target, what it lost it to, and how fast it answers."""
