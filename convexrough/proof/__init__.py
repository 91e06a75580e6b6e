"""Proofs as files, for `convexrough.checker` or anybody else's (docs/theory/proof-file.md)."""

from convexrough.proof.proof import Near, Proof, Sheared, prove, refuse_many

__all__ = ["Near", "Proof", "Sheared", "prove", "refuse_many"]
