"""Rough frictional contact as one convex program, with a proof of which asperities touch."""

from convexrough import solvers
from convexrough.contact import Contact, press
from convexrough.errors import ConvexroughError, FileError, InputError, SolverError
from convexrough.normal.certificate import Certificate, certify
from convexrough.paths.memory import MemoryCurve
from convexrough.paths.path import LoadPath, load_path
from convexrough.paths.shakedown import Shakedown, shakedown
from convexrough.paths.shapes import elliptic_path
from convexrough.paths.steady import Steady, steady
from convexrough.run.scene_file import SceneFile, read_scene
from convexrough.scene.asperities import Asperities
from convexrough.scene.material import Material
from convexrough.scene.scene import Scene
from convexrough.shearing.certificate import ShearCertificate
from convexrough.shearing.cycle import Cycle, Loop, cycle, cycles
from convexrough.shearing.history import History, history
from convexrough.shearing.state import ShearState, onset_of_sliding, shear
from convexrough.sphere.smooth import SmoothSphere, smooth
from convexrough.vector_shear.cones import FrictionConic
from convexrough.vector_shear.newton import FrictionNewton
from convexrough.vector_shear.state import VectorShearState, shear_vector
from convexrough.verdict import Verdict, verify
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
    "LoadPath",
    "Loop",
    "Material",
    "MemoryCurve",
    "Scene",
    "SceneFile",
    "Shakedown",
    "ShearCertificate",
    "ShearState",
    "SmoothSphere",
    "SolverError",
    "Steady",
    "VectorShearState",
    "Verdict",
    "__version__",
    "certify",
    "cycle",
    "cycles",
    "elliptic_path",
    "history",
    "load_path",
    "onset_of_sliding",
    "press",
    "read_scene",
    "shakedown",
    "shear",
    "shear_vector",
    "smooth",
    "solvers",
    "steady",
    "verify",
]
