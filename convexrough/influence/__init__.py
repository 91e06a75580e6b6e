"""Elastic coupling between asperities, as an operator that knows its own rounding error."""

from convexrough.influence.choice import KINDS, couple
from convexrough.influence.coupling import Influence, Kind
from convexrough.influence.dense import DenseInfluence

__all__ = ["KINDS", "DenseInfluence", "Influence", "Kind", "couple"]
