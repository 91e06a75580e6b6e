"""Shear with the full tangential kernel: forces and slips are vectors."""
