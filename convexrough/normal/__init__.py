"""The normal contact problem, bounds on the approach under a load, and the certificate."""
