"""Comparison of claimed loads and shear forces with what is proved about the solution."""

from convexrough.verdict.verdict import Verdict as Verdict
from convexrough.verdict.verdict import verify as verify
