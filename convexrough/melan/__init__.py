"""Shakedown: how far a load path may be scaled until asperities slide in every cycle."""
