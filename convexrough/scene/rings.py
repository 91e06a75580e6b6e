"""Rings of asperities about the axis of the sphere, and evenly chosen items of a sequence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from convexrough.arrays import Array, Indices

#: Distances that differ by less than this, relative to the largest, count as equal.
SAME = 1e-9

Item = TypeVar("Item")


def rings(distances: Array, loads: Array) -> list[Indices]:
    """The loaded asperities, grouped by distance from the axis, the innermost group first."""
    touching = np.flatnonzero(loads)
    order = np.argsort(distances[touching], kind="stable")
    outwards = distances[touching[order]]
    ends = np.flatnonzero(np.diff(outwards) > SAME * outwards.max(initial=0.0)) + 1
    return [np.sort(ring) for ring in np.split(touching[order], ends) if len(ring)]


def one_of_each_ring(distances: Array, loads: Array, most: int) -> list[int]:
    """The first asperity of each ring, for at most `most` evenly chosen rings."""
    return [int(ring[0]) for ring in evenly_chosen(rings(distances, loads), most)]


def evenly_chosen(items: Sequence[Item], most: int) -> list[Item]:
    """At most `most` of the items, evenly chosen, with the first and the last."""
    places = np.linspace(0, len(items) - 1, min(most, len(items))).astype(int)
    return [items[i] for i in places]
