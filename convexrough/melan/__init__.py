"""Shakedown: the largest factor of a load path at which no asperity slides in every cycle."""
