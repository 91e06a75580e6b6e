"""Rings of asperities about the axis of the sphere, and evenly chosen items of a sequence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from convexrough.arrays import Array, Indices

#: Distances count as equal if they differ by less than this part of the largest distance.
SAME = 1e-9

Item = TypeVar("Item")


def rings(distances: Array, loads: Array) -> list[Indices]:
    """The indices of loaded asperities in groups of equal distance from the axis, nearest first."""
    touching = np.flatnonzero(loads)
    order = np.argsort(distances[touching], kind="stable")
    outwards = distances[touching[order]]
    ends = np.flatnonzero(np.diff(outwards) > SAME * outwards.max(initial=0.0)) + 1
    return [np.sort(ring) for ring in np.split(touching[order], ends) if len(ring)]


def one_of_each_ring(distances: Array, loads: Array, most: int) -> list[int]:
    """The first loaded asperity of each of at most `most` rings, which are evenly chosen."""
    return [int(ring[0]) for ring in evenly_chosen(rings(distances, loads), most)]


def evenly_chosen(items: Sequence[Item], most: int) -> list[Item]:
    """At most `most` evenly chosen items of a sequence, including its first and its last one."""
    places = np.linspace(0, len(items) - 1, min(most, len(items))).astype(int)
    return [items[i] for i in places]
