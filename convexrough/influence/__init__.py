"""Elastic coupling between asperities, as an operator that knows its own rounding error."""

from convexrough.influence.choice import KINDS, couple
from convexrough.influence.coupling import (
    Coupling,
    Influence,
    Kind,
    Rounding,
    Smoother,
    fitted_shells,
    inverse_distances,
    shells,
    spread,
)
from convexrough.influence.dense import DenseInfluence
from convexrough.influence.lattice import LatticeInfluence
from convexrough.influence.scattered import ScatteredInfluence

__all__ = [
    "KINDS",
    "Coupling",
    "DenseInfluence",
    "Influence",
    "Kind",
    "LatticeInfluence",
    "Rounding",
    "ScatteredInfluence",
    "Smoother",
    "couple",
    "fitted_shells",
    "inverse_distances",
    "shells",
    "spread",
]
