"""Studies of feet and of the persons who wear them: controls of the price, learned persons, orthoses."""
