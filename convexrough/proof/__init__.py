"""Proofs as files, for `convexrough.checker` or anybody else's (docs/theory/proof-file.md)."""

from convexrough.proof.proof import NearState, Proof, ShearedState, prove, refuse_many

__all__ = ["NearState", "Proof", "ShearedState", "prove", "refuse_many"]
