"""Shakedown: the factor of a load path up to which sliding of asperities ceases."""
