"""Training by PPO: configuration, runs, checkpoints, several seeds."""
