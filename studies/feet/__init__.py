"""Studies of feet and of their wearers: controls of the price, learned persons, orthoses."""
