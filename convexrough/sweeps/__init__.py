"""Many scenes: which they are, what is measured of each, who computes them, and their table."""
