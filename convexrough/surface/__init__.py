"""Asperities from measured surfaces: reading, detrending, summits, and comparison with theory."""

from convexrough.surface.boundary_elements import Whole, press_whole
from convexrough.surface.moments import Moments
from convexrough.surface.provability import Provability, crowded, model_errors, provability
from convexrough.surface.reading import read
from convexrough.surface.self_affine import self_affine, self_affine_moments
from convexrough.surface.summits import Origin, Summits
from convexrough.surface.surface import Surface

__all__ = [
    "Moments",
    "Origin",
    "Provability",
    "Summits",
    "Surface",
    "Whole",
    "crowded",
    "model_errors",
    "press_whole",
    "provability",
    "read",
    "self_affine",
    "self_affine_moments",
]
