"""What `import convexrough` gives: names and laziness."""

import subprocess
import sys

import pytest

import convexrough as cr

LAZY = """
import sys
import convexrough as cr
heavy = {"numpy", "scipy", "cvxpy", "clarabel", "osqp", "matplotlib", "pydantic", "click", "rich"}
assert not heavy & {*sys.modules}
from convexrough import cli
cli.main(["--help"])
unused = {"pydantic", "matplotlib", "rich", "cvxpy", "scipy.spatial", "scipy.linalg"}
assert not unused & {*sys.modules}
cr.testing.assert_certified, cr.compare.compare
scene = cr.Scene(1.0, cr.Asperities([[0.0, 0.0]], 1.0), cr.Material(1.0, 0.3))
repr(cr.press(scene, approach=1e-4))
file = cr.read_scene(cr.__path__[0] + "/run/new_scene.toml")
file.compute(file.press())
assert not {"pandas", "xarray", "matplotlib"} & {*sys.modules}
cr.plots.press_figures
assert "matplotlib.pyplot" not in sys.modules
"""


def test_libraries_are_imported_when_they_are_needed() -> None:
    done = subprocess.run([sys.executable, "-c", LAZY], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert all(name in done.stdout for name in ("run", "verify", "new", "paper"))


def test_every_public_name_is_there() -> None:
    assert all(hasattr(cr, name) for name in cr.__all__)
    assert set(cr.__all__) == set(dir(cr))
    with pytest.raises(AttributeError, match="pres"):
        _ = cr.pres
