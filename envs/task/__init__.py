"""The task: observation, reward, ground, pushes, start and end of an episode."""
