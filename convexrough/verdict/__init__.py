"""Comparison of claimed loads and shear forces with the proof."""

from convexrough.verdict.verdict import Verdict as Verdict
from convexrough.verdict.verdict import verify as verify
