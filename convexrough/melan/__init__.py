"""Shakedown: the largest factor of a load path at which asperities stop sliding."""
