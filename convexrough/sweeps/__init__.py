"""Sweeps over many scenes: their enumeration, measures, workers and tables."""
