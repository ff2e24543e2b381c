"""From recorded walks to a verdict: how human a walk is."""
