"""The one exception of springfoot."""


class SpringfootError(ValueError):
    """Bad input or an impossible request: one line saying what was wrong and what is allowed."""
