"""The walk that is steered from a browser while it runs."""
