"""Training on a Ray cluster: RLlib as the engine of one training, and several trainings on its nodes."""
