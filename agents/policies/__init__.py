"""Policies: files, networks trained elsewhere, schedules and baselines."""
