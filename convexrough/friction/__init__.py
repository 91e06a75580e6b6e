"""Friction in one direction: all of it is normal solutions at two or more total loads."""
