"""What is pressed on what: material, asperities, the sphere, and the patterns they stand in."""
