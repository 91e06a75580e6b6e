"""Rough frictional contact as one convex program, with a proof of which asperities touch."""

from convexrough import solvers
from convexrough.certificate import Certificate, certify
from convexrough.contact import Contact, press
from convexrough.errors import ConvexroughError, FileError, InputError, SolverError
from convexrough.scene import Asperities, Material, Scene

__version__ = "0.1.0"

__all__ = [
    "Asperities",
    "Certificate",
    "Contact",
    "ConvexroughError",
    "FileError",
    "InputError",
    "Material",
    "Scene",
    "SolverError",
    "certify",
    "press",
    "solvers",
]
