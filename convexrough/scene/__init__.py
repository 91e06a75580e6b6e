"""The scene: material, asperities and their patterns, and the sphere or another base."""
