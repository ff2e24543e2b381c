"""The settings of the walking task, and the feet that they name."""
