"""Walks planned by their zero-moment point (ZMP): CoM, feet, posture, forces, moments and effort."""
