"""Friction in one direction, computed from normal solutions at two or more total loads."""
