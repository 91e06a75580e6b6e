"""Asperities from measured surfaces: reading, detrending, summits, and comparison with theory."""

from convexrough.contact import model_errors as model_errors
from convexrough.surface.boundary_elements import Whole as Whole
from convexrough.surface.boundary_elements import press_whole as press_whole
from convexrough.surface.pixels import Moments as Moments
from convexrough.surface.provability import Provability as Provability
from convexrough.surface.provability import crowded as crowded
from convexrough.surface.provability import provability as provability
from convexrough.surface.reading import read as read
from convexrough.surface.self_affine import self_affine as self_affine
from convexrough.surface.self_affine import self_affine_moments as self_affine_moments
from convexrough.surface.summits import Origin as Origin
from convexrough.surface.summits import Summits as Summits
from convexrough.surface.surface import Surface as Surface
