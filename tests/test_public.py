"""What `import convexrough` gives: names, laziness, and words for values of the wrong type."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scenes import MATERIAL, PAPER_APPROACH, paper

import convexrough as cr

LAZY = """
import sys
import convexrough as cr
heavy = {"numpy", "scipy", "cvxpy", "clarabel", "osqp", "matplotlib", "pydantic", "click", "rich"}
assert not heavy & {*sys.modules}
from convexrough import cli
cli.main(["--help"])
assert not {"pydantic", "matplotlib", "rich", "cvxpy", "scipy.linalg"} & {*sys.modules}
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


def test_every_public_name_is_there() -> None:
    assert all(hasattr(cr, name) for name in cr.__all__)
    assert set(cr.__all__) == set(dir(cr))
    with pytest.raises(AttributeError, match="pres"):
        _ = cr.pres


@pytest.mark.parametrize(
    ("call", "said"),
    [
        ("cr.press(scene.asperities, approach=5e-5)",
         "scene: found type Asperities, expected a Scene"),
        ("cr.press(cr.Scene, approach=5e-5)", "scene: found the class Scene, expected a Scene"),
        ("cr.press(scene, approach='5e-5')", "approach: found '5e-5', expected a finite number"),
        ("cr.press(scene, approach=5e-5, solver=cr.solvers.Newton)", "found the class Newton"),
        ("cr.press(scene, approach=5e-5, solver='connic')", 'expected one of "newton", "conic"'),
        ("cr.verify([0.0], scene, approach=5e-5)", "scene: found type list, expected a Scene"),
        ("cr.certify(scene, ['1'] * 61, approach=5e-5)", r"loads: found \['1'.*expected numbers"),
        ("cr.Scene('1', scene.asperities, scene.material)", "sphere_radius: found '1'"),
        ("cr.shear(scene, force=0.0)", "contact: found type Scene, expected a Contact"),
        ("cr.testing.assert_shear_certified(scene, [0.0], force=0.0)", "expected a Contact"),
        ("cr.Material(youngs_modulus=2.0, poisson_ratio=0.3)", r"Material\.from_youngs\("),
        ("cr.Material(1.0)", "poisson_ratio: found None, expected a number from 0"),
        ("cr.Asperities(pd.DataFrame({'y': [0.0], 'x': [1.0]}), 1.0)", "found columns y, x"),
        ("cr.certify(scene, np.ma.masked_less(np.ones(61), 2), load=1.0)", "found 61 masked"),
        ("cr.press(scene, approach=5e-5, start=contact)", "start: found type Contact, expected n"),
        ("cr.cycle(contact, maximum=[1e-8, 2e-8])", "maximum: found shape .2,., expected one numb"),
        ("cr.cycles(contact, [1e-8, 2e-8], [1e-9])", "minimum: .*expected 2 values, one per max"),
        ("cr.loops(cr.cycle(contact, maximum=1e-8))", "cycles: found type Cycle, expected a list"),
        ("cr.load_path(contact, loads=[1], forces=[0])", "scene: found type Contact"),
        ("cr.shear_vector(contact, force=1e-8, solver='conic')", "solver: found 'conic', expected"),
        ("cr.press_many(scene, load=1.0)", "scenes: found type Scene, expected a list of scenes"),
        ("cr.read_scene(5)", "path: found 5, expected the name of a scene file"),
        ("contact.proof(sheared=[1e-8])", r"sheared\[0\]: found 1e-08, expected a shear state"),
        ("contact.proof(sheared=[cr.shear(contact, force=0)])",
         r"sheared\[0\].*force 0, expected one"),
        ("contact.proof(sheared=[cr.shear(cr.press(scene, load=1e-7), force=0)])",
         "another contact"),
        ("cr.solvers.Newton(max_iterations=1.5)", "max_iterations: found 1.5, expected a whole"),
        ("cr.solvers.Newton(tolerance=-1.0)", "tolerance: found -1.0, expected a number that is"),
        ("cr.solvers.Conic(max_iterations=-3)", "max_iterations: found -3, expected a whole"),
        ("cr.prove_order(contact, most='a')", "most: found 'a', expected a whole number"),
        ("cr.certify(scene, [1e99] * 61, load=1.0)", r"found 1e\+99, expected .*, at most 1e\+60"),
        ("cr.Asperities(pd.DataFrame({'Y [mm]': [0.0], 'X [mm]': [1.0]}), 1.0)", "columns Y "),
        ("cr.Asperities(pd.DataFrame({'x': [0.0], 'height': [1.0]}), 1.0)", "columns x, height"),
        ("cr.Asperities(TWO[['x', 'y']], 1.0, TWO['z'][::-1])", "heights: found another index"),
        ("cr.certify(scene, pd.Series(np.ones(61))[::-1], load=1.0)", "index in another order"),
        ("cr.compare.compare(scene)", "approach, load: found neither"),
        ("cr.compare.compare(scene, load=-1.0)", "load: found -1"),
        ("cr.testing.assert_agree(contact, contact.loads)", "scene: found none"),
        ("cr.testing.assert_agree(contact, OTHER)", "second: found 1, expected as many"),
        ("cr.testing.assert_agree(contact, contact, within=5)", "within: found 5, expected a frac"),
        ("cr.testing.assert_agree(contact, cr.press(scene, load=contact.load))",
         "second: found prescribed load .*, as in the first"),
        ("cr.testing.assert_shear_certified(contact, np.zeros(61), force=0.0, sliding=[1])",
         r"sliding: found shape \(1,\) of int64, expected"),
        ("cr.testing.assert_certified(scene, -1.0, approach=5e-5)", r"loads\[0\]: found -1"),
        ("contact.plot('load')", "axes: found type str, expected Axes"),
        ("contact.columns('loads', 'load')", "columns: found 'load', expected some of stat"),
        ("cr.testing.assert_agree(contact, cr.shear(contact, force=0))", "type ShearState, exp"),
        ("(p := cr.program(scene, load=1e-7)).loads(p.data.linear * np.nan)",
         r"values\[0\]: found nan"),
    ],
)  # fmt: skip
def test_wrong_types_are_said(call: str, said: str) -> None:
    scene = replace(paper(), friction=0.5)
    contact = cr.press(scene, approach=PAPER_APPROACH)
    two = pd.DataFrame({"x": [0.0, 1.0], "y": 0.0, "z": 0.0})
    other = cr.press(cr.Scene(1.0, cr.Asperities([[0.0, 0.0]], 1.0), MATERIAL), approach=1e-4)
    given = {"TWO": two, "OTHER": other, "scene": scene, "contact": contact}
    with pytest.raises(cr.InputError, match=said):
        eval(call, {"cr": cr, "np": np, "pd": pd, **given})
