"""Rough frictional contact as one convex program, with a proof of which asperities touch."""

from convexrough import solvers
from convexrough.certificate import Certificate, certify
from convexrough.contact import Contact, press
from convexrough.cycle import Cycle, Loop, cycle, cycles
from convexrough.errors import ConvexroughError, FileError, InputError, SolverError
from convexrough.friction import VectorShearState, shear_vector
from convexrough.friction_cones import FrictionConic
from convexrough.friction_newton import FrictionNewton
from convexrough.history import History, history
from convexrough.scene import Asperities, Material, Scene
from convexrough.scene_file import SceneFile, read_scene
from convexrough.shear import ShearCertificate, ShearState, onset_of_sliding, shear
from convexrough.smooth import SmoothSphere, smooth
from convexrough.version import __version__

__all__ = [
    "Asperities",
    "Certificate",
    "Contact",
    "ConvexroughError",
    "Cycle",
    "FileError",
    "FrictionConic",
    "FrictionNewton",
    "History",
    "InputError",
    "Loop",
    "Material",
    "Scene",
    "SceneFile",
    "ShearCertificate",
    "ShearState",
    "SmoothSphere",
    "SolverError",
    "VectorShearState",
    "__version__",
    "certify",
    "cycle",
    "cycles",
    "history",
    "onset_of_sliding",
    "press",
    "read_scene",
    "shear",
    "shear_vector",
    "smooth",
    "solvers",
]
