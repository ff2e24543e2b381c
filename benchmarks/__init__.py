"""Measure the cost of a step beside its physics, and of training beside its steps: `make bench`."""
