"""Measurements of the speed of every solver, at many sizes, with the true error of each answer."""
