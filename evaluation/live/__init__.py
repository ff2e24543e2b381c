"""Steer a walk from a browser while it runs."""
