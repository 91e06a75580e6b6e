"""Sweeps over many scenes: scenes, measured numbers, workers and tables."""
