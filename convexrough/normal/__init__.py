"""Pressing: the normal problem, what a prescribed load implies, and the certificate."""
