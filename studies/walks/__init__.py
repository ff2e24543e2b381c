"""Studies of walks: policies side by side, bodies, trainings."""
