"""Elastic coupling between asperities: operators with bounds on their rounding errors."""

from convexrough.influence.choice import KINDS, couple
from convexrough.influence.coupling import Influence, Kind
from convexrough.influence.dense import DenseInfluence

__all__ = ["KINDS", "DenseInfluence", "Influence", "Kind", "couple"]
