"""Elastic coupling of asperities: operators with bounds on the rounding errors of products."""

from convexrough.influence.choice import KINDS, couple
from convexrough.influence.coupling import Influence, Kind
from convexrough.influence.dense import DenseInfluence

__all__ = ["KINDS", "DenseInfluence", "Influence", "Kind", "couple"]
