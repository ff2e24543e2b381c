"""Stiffness: the law of the joints, schedules over the stride, and springs identified from motion."""
