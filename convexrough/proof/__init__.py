"""Proof files for `convexrough.checker` or another checker (docs/theory/proof-file.md)."""

from convexrough.proof.proof import NearState, Proof, ShearedState, prove, refuse_many

__all__ = ["NearState", "Proof", "ShearedState", "prove", "refuse_many"]
