"""The scene: a sphere or another base, asperities and their patterns, and material."""
