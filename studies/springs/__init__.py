"""Studies of stiffness: agreement, identification, influence."""
