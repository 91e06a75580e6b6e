"""Rough frictional contact as one convex program, with a proof of which asperities touch.

Nothing is imported before it is used: the command line starts at once, and an interrupt finds no
import half done.

In the examples of docstrings `cr` is this package and `np` numpy, `scene` is that of `Scene` and
`contact` that of `press`: the source paper's, of which 37 of 61 asperities touch; `new_scene` is
what `convexrough new` writes, and `folder` is an empty folder.
"""

from __future__ import annotations

TYPE_CHECKING = False  # that of typing, which takes longer to import than all of this
if TYPE_CHECKING:
    from typing import Any

    from convexrough import compare as compare
    from convexrough import fields as fields
    from convexrough import gallery as gallery
    from convexrough import plots as plots
    from convexrough import solvers as solvers
    from convexrough import surface as surface
    from convexrough import testing as testing
    from convexrough.contact import Contact, press
    from convexrough.errors import (
        ConvexroughError,
        FileError,
        InputError,
        ProofError,
        SolverError,
        WorkerError,
    )
    from convexrough.friction.curve import MemoryCurve
    from convexrough.friction.cycle import Cycle, Loop, cycle, cycles, loops, steady
    from convexrough.friction.fretting import Fretting, fretting
    from convexrough.friction.onset import onset_of_sliding
    from convexrough.friction.path import History, LoadPath, history, load_path
    from convexrough.friction.phases import PhaseLosses, phase_losses
    from convexrough.friction.shapes import elliptic_path
    from convexrough.friction.shear import ShearCertificate, ShearState, certify_shear, shear
    from convexrough.friction.side_by_side import PathComparison, PathEntry, compare_paths
    from convexrough.gradients.change import ContactChange, Direction, ShearChange
    from convexrough.gradients.gradient import Gradient
    from convexrough.gradients.objective import Objective
    from convexrough.gradients.states import onset_gradient
    from convexrough.melan.shakedown import Shakedown, shakedown
    from convexrough.normal.certificate import Certificate, certify
    from convexrough.run.scene_file import SceneFile, read_scene
    from convexrough.scene.asperities import Asperities
    from convexrough.scene.material import Material
    from convexrough.scene.scene import Scene
    from convexrough.sphere.smooth import SmoothEllipsoid, SmoothSphere, smooth
    from convexrough.sweeps.sweep import sweep
    from convexrough.sweeps.table import SweepTable, open_sweep
    from convexrough.vector_shear.cones import FrictionConic
    from convexrough.vector_shear.newton import FrictionNewton
    from convexrough.vector_shear.state import VectorShearState, shear_vector
    from convexrough.verdict import Verdict, verify
    from convexrough.version import __version__

#: Where each public name lives.
_HOMES = {
    "contact": ("Contact", "press"),
    "errors": (
        "ConvexroughError",
        "FileError",
        "InputError",
        "ProofError",
        "SolverError",
        "WorkerError",
    ),
    "friction.curve": ("MemoryCurve",),
    "friction.cycle": ("Cycle", "Loop", "cycle", "cycles", "loops", "steady"),
    "friction.fretting": ("Fretting", "fretting"),
    "friction.onset": ("onset_of_sliding",),
    "friction.path": ("History", "LoadPath", "history", "load_path"),
    "friction.phases": ("PhaseLosses", "phase_losses"),
    "friction.shapes": ("elliptic_path",),
    "friction.shear": ("ShearCertificate", "ShearState", "certify_shear", "shear"),
    "friction.side_by_side": ("PathComparison", "PathEntry", "compare_paths"),
    "gradients.change": ("ContactChange", "Direction", "ShearChange"),
    "gradients.gradient": ("Gradient",),
    "gradients.objective": ("Objective",),
    "gradients.states": ("onset_gradient",),
    "melan.shakedown": ("Shakedown", "shakedown"),
    "normal.certificate": ("Certificate", "certify"),
    "run.scene_file": ("SceneFile", "read_scene"),
    "scene.asperities": ("Asperities",),
    "scene.material": ("Material",),
    "scene.scene": ("Scene",),
    "sphere.smooth": ("SmoothEllipsoid", "SmoothSphere", "smooth"),
    "sweeps.sweep": ("sweep",),
    "sweeps.table": ("SweepTable", "open_sweep"),
    "vector_shear.cones": ("FrictionConic",),
    "vector_shear.newton": ("FrictionNewton",),
    "vector_shear.state": ("VectorShearState", "shear_vector"),
    "verdict": ("Verdict", "verify"),
    "version": ("__version__",),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}

#: Modules that are public whole; those not in `__all__` draw, or are for tests.
_MODULES = ("compare", "fields", "gallery", "plots", "solvers", "surface", "testing")

__all__ = [
    "Asperities",
    "Certificate",
    "Contact",
    "ContactChange",
    "ConvexroughError",
    "Cycle",
    "Direction",
    "FileError",
    "Fretting",
    "FrictionConic",
    "FrictionNewton",
    "Gradient",
    "History",
    "InputError",
    "LoadPath",
    "Loop",
    "Material",
    "MemoryCurve",
    "Objective",
    "PathComparison",
    "PathEntry",
    "PhaseLosses",
    "ProofError",
    "Scene",
    "SceneFile",
    "Shakedown",
    "ShearCertificate",
    "ShearChange",
    "ShearState",
    "SmoothEllipsoid",
    "SmoothSphere",
    "SolverError",
    "SweepTable",
    "VectorShearState",
    "Verdict",
    "WorkerError",
    "__version__",
    "certify",
    "certify_shear",
    "compare_paths",
    "cycle",
    "cycles",
    "elliptic_path",
    "fretting",
    "history",
    "load_path",
    "loops",
    "onset_gradient",
    "onset_of_sliding",
    "open_sweep",
    "phase_losses",
    "press",
    "read_scene",
    "shakedown",
    "shear",
    "shear_vector",
    "smooth",
    "solvers",
    "steady",
    "sweep",
    "verify",
]


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name in _MODULES:
        return import_module(f"convexrough.{name}")
    if name not in _HOME:
        raise AttributeError(f"module 'convexrough' has no attribute {name!r}")
    value = getattr(import_module(f"convexrough.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *_MODULES})
