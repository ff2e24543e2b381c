"""What a step costs beside its physics, and training beside its steps: `make bench`."""
