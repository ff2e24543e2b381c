"""Studies of feet: people adapted to a foot, prostheses, orthoses."""
