"""Asperities in rings about the axis of the sphere, and how a few of many are chosen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from convexrough.arrays import Array, Indices

#: Distances that differ by less than this, relative to the largest, are one.
SAME = 1e-9

Item = TypeVar("Item")


def rings(distances: Array, loads: Array) -> list[Indices]:
    """The loaded asperities, in groups at the same distance from the axis; outwards."""
    touching = np.flatnonzero(loads)
    order = np.argsort(distances[touching], kind="stable")
    outwards = distances[touching[order]]
    ends = np.flatnonzero(np.diff(outwards) > SAME * outwards.max(initial=0.0)) + 1
    return [np.sort(ring) for ring in np.split(touching[order], ends) if len(ring)]


def one_of_each_ring(distances: Array, loads: Array, most: int) -> list[int]:
    """The first asperity of each ring, of at most so many rings."""
    return [int(ring[0]) for ring in evenly_chosen(rings(distances, loads), most)]


def evenly_chosen(items: Sequence[Item], most: int) -> list[Item]:
    """All the items, or of more than `most` so many; the first and the last are kept."""
    places = np.linspace(0, len(items) - 1, min(most, len(items))).astype(int)
    return [items[i] for i in places]
