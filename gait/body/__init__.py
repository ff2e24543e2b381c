"""The body: lengths, masses and inertias, the mechanics of a leg, passive tissue, and rolling feet."""
