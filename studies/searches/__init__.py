"""Searches: leg constants, plans, a walk from the plan alone."""
