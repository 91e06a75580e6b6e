"""The scene: a sphere or another pressed body, asperities and their patterns, and the material."""
