"""Claims of loads and shear forces from anywhere, held against what is proved."""

from convexrough.verdict.verdict import Verdict as Verdict
from convexrough.verdict.verdict import verify as verify
