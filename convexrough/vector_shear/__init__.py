"""Shear with the full tangential compliance: forces and slips are vectors."""
