"""The normal contact problem, bounds from a prescribed load, and the certificate."""
