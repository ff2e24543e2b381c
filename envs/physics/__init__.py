"""What the body is: its MuJoCo model, its feet on the ground, and the simulation of many."""
