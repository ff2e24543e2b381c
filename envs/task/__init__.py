"""What is asked of the body: observation, reward, ground, pushes and the start of an episode."""
