"""Results in the forms people use: printed, as tables, pickled, drawn; docstrings; imports."""

import copy
import dataclasses
import doctest
import html
import importlib
import pickle
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scenes import MATERIAL, PAPER_APPROACH, paper

import convexrough as cr
from convexrough import compare, plots, solvers
from convexrough.errors import ExtraError, MistakesError
from convexrough.plots.notebook import ShownAxes
from convexrough.record import Record, singular

NEW_SCENE = Path(plots.__file__).parent.parent / "run/new_scene.toml"


@cache
def results() -> dict[str, Any]:
    """One of each kind."""
    scene = dataclasses.replace(paper(), friction=0.5)
    contact = cr.press(scene, approach=PAPER_APPROACH)
    Q = 0.25 * contact.load
    wrong = contact.loads.copy()
    wrong[3] = 0.0
    higher = cr.Direction(heights=1e-8)
    state, cycle = cr.shear(contact, force=Q), cr.cycle(contact, maximum=Q)
    few = (solvers.Conic(), solvers.BristleQP())
    contacts = cr.press_many([scene, scene], approach=PAPER_APPROACH)
    surface = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=128).detrend("sphere")
    summits = surface.summits()
    found = (
        surface, surface.moments, summits, summits.origin,
        cr.surface.provability(summits, lambda left: on(left, surface), levels=[0.05, 0.2]),
        scene, scene.asperities, contact, contact.certificate, contacts, contacts.cycles(Q),
        state, state.certificate, cr.shear_vector(contact, force=Q),
        cycle, cycle.loop(16, asperities=[0, 3]), cycle.gradient(), cr.fretting(cycle),
        cr.verify(scene, wrong, approach=PAPER_APPROACH),
        compare(scene, approach=PAPER_APPROACH, solvers=few),
        cr.smooth(scene, load=contact.load),
        cr.smooth(dataclasses.replace(scene, sphere_radius=(1.0, 2.0)), load=contact.load),
        cr.read_scene(NEW_SCENE),
        contact.proof(),
        cr.load_path(scene, loads=contact.load * np.array([1.0, 0.7]), forces=[Q, -Q / 2]),
        cr.shakedown(scene, load=contact.load, force_amplitudes=[Q, -Q]),
        cr.phase_losses(scene, load=contact.load, load_amplitude=Q, force_amplitude=Q / 2,
                        phases=[0.0, 1.0], factors=[0.5, 1.0], chords=6),
        cr.MemoryCurve.pressed(1.0).go(1.0, 0.25)[0],
        cr.program(scene, approach=PAPER_APPROACH),
        higher, contact.change(higher), state.change(higher),
        cr.Objective(scene=scene, of="loss", load=contact.load, force=Q),
    )  # fmt: skip
    return {type(each).__name__: each for each in found}


def on(asperities: cr.Asperities, surface: cr.surface.Surface) -> cr.Contact:
    radius = 1e4 * surface.pixel[0]
    return cr.press(cr.Scene(radius, asperities, MATERIAL, geometry="summit"), load=10.0)


def having(method: str) -> dict[str, Any]:
    return {name: each for name, each in results().items() if hasattr(each, method)}


def test_every_kind_is_here() -> None:
    public = {name for name in cr.__all__ if dataclasses.is_dataclass(getattr(cr, name))}
    settings = {"FrictionConic", "FrictionNewton", "Material"}
    sweeps = {"SweepTable"}  # tested in tests/sweeps
    assert public - settings - sweeps <= set(results())
    assert set(having("plot")) == {"Contact", "ShearState", "VectorShearState", "Cycle", "Fretting",
                          "Verdict", "Comparison", "LoadPath", "Shakedown",
                          "MemoryCurve", "PhaseLosses", "Gradient", "Surface", "Summits",
                          "Provability"}  # fmt: skip


def test_a_result_is_printed_on_one_screen_and_in_a_notebook() -> None:
    for name, result in results().items():
        lines = repr(result).split("\n")
        assert lines[0] == name
        assert 2 <= len(lines) <= 26, name
        assert max(map(len, lines)) <= 110, name
        assert "array(" not in repr(result), name
        cells = html.unescape(re.sub("<[^>]*>", "\n", result._repr_html_())).split("\n")
        shown = [part.strip() for line in lines for part in line.strip().split("  ", 1)]
        assert [text.strip() for text in cells if text.strip()] == [it for it in shown if it]


def arrays(record: Any) -> Iterator[np.ndarray[Any, Any]]:
    """Those of a result and of the results inside."""
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        if isinstance(value, np.ndarray):
            yield value
        for each in value if isinstance(value, tuple) else (value,):
            if isinstance(each, Record):
                yield from arrays(each)


def test_copies_keep_every_bit_and_what_is_read_only() -> None:
    replace = getattr(copy, "replace", dataclasses.replace)  # copy.replace is new in Python 3.13
    for name, first in results().items():
        assert repr(replace(first)) == repr(first), name
        for second in (pickle.loads(pickle.dumps(first)), copy.deepcopy(first)):
            assert (type(second), repr(second)) == (type(first), repr(first))
            for one, other in zip(arrays(first), arrays(second), strict=True):
                assert one is not other
                np.testing.assert_array_equal(one, other)
                assert not other.flags.writeable


def test_errors_pass_between_processes() -> None:
    for error in (
        cr.InputError("load", found=-1, expected="a positive number", where="a.toml"),
        cr.SolverError("no step", solver="newton", advice="less load", iterate=np.ones(2)),
        MistakesError("a.toml", ["one", "two"]),
        ExtraError("pandas"),
        cr.FileError("a.toml: missing"),
    ):
        again = pickle.loads(pickle.dumps(error))
        assert (type(again), str(again), again.args) == (type(error), str(error), error.args)
        assert repr(vars(again)) == repr(vars(error))


def columns(result: Any) -> dict[str, np.ndarray[Any, Any]]:
    """Every array that a result says it has, by the name of one value."""
    names = [name for each in getattr(result, "_along", {}).values() for name in each]
    found = {}
    for name in names:
        one, values = singular(name), getattr(result, name)
        both = one != name and one in names
        if values is not None:
            found[f"asperity_{one}" if both else one] = np.asarray(values)
    return found


#: What a row of a table is, where it is no asperity.
ROWS = {"Loop": "point", "Comparison": "entry", "LoadPath": "point",
        "MemoryCurve": "vertex", "PhaseLosses": "ellipse",
        "Provability": "level", "Contacts": "scene", "Cycles": "scene"}  # fmt: skip


def test_data_frames_and_data_sets_have_the_arrays() -> None:
    for name, result in having("to_dataframe").items():
        frame, held = result.to_dataframe(), result.to_xarray()
        assert frame.index.name == ROWS.get(name, "asperity")
        for column, values in columns(result).items():
            if values.ndim == 1 and column in frame.columns:
                np.testing.assert_array_equal(frame[column].to_numpy(), values)
            elif f"{column}_x" in frame.columns:
                np.testing.assert_array_equal(frame[f"{column}_y"].to_numpy(), values[:, 1])
            if name != "MemoryCurve":  # names its own
                np.testing.assert_array_equal(held[column].to_numpy(), values)
        for key, value in (*frame.attrs.items(), *held.attrs.items()):
            assert getattr(result, key) == value
        if "load" in held:
            held["load"][0] = -1.0  # a copy: the result stays as it is


def test_gradients_have_all_arrays() -> None:
    gradient = results()["LoadPath"].gradient()
    held = gradient.to_xarray()
    for name in ("position_errors", "forces", "force_errors", "force_sides", "loads", "load_sides"):
        np.testing.assert_array_equal(held[singular(name)], getattr(gradient, name))
        assert f"\n  {name} " in repr(gradient)
    assert "; 2 scenes of 61 asperities\n" in repr(results()["Cycles"])


def test_axes_in_axes_out() -> None:
    for name, result in having("plot").items():
        alone = result.plot()
        assert isinstance(alone, Axes)
        mine, other = Figure().subplots(1, 2)
        assert plots.plot(result, other) is other
        assert (mine.has_data(), other.has_data()) == (False, True), name
        assert other.get_xlabel()


def test_axes_are_shown_in_notebooks() -> None:
    axes = Figure().add_subplot(axes_class=ShownAxes)
    assert axes._repr_png_().startswith(b"\x89PNG")


ROOT = Path(cr.__file__).parent
EXAMPLES = sorted(path for path in ROOT.rglob("*.py") if ">>> " in path.read_text("utf-8"))


@pytest.mark.usefixtures("no_processes")
@pytest.mark.sample(12)
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: str(path.relative_to(ROOT)))
def test_examples_in_docstrings(path: Path, tmp_path: Path) -> None:
    scene = dataclasses.replace(paper(), friction=0.5)
    names = {
        "cr": cr, "np": np, "scene": scene, "contact": results()["Contact"], "new_scene": NEW_SCENE,
        "folder": tmp_path,
    }  # fmt: skip
    module = ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)
    found = doctest.DocTestFinder().find(importlib.import_module(module), extraglobs=names)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    for test in found:
        runner.run(test)
    assert runner.tries > 0
    assert runner.failures == 0


LAZY = """
import sys
import convexrough as cr
heavy = {"numpy", "scipy", "cvxpy", "clarabel", "osqp", "matplotlib", "pydantic", "click", "rich"}
assert not heavy & {*sys.modules}
from convexrough import cli
cli.main(["--help"])
unused = {"pydantic", "matplotlib", "rich", "cvxpy", "scipy.spatial", "scipy.linalg"}
assert not unused & {*sys.modules}
cr.testing.assert_certified, cr.compare
scene = cr.Scene(1.0, cr.Asperities([[0.0, 0.0]], 1.0), cr.Material(1.0, 0.3))
repr(cr.press(scene, approach=1e-4))
cli.main(["run", cr.__path__[0] + "/run/new_scene.toml", "--out", "out", "--no-figures"])
assert not {"pandas", "xarray", "matplotlib"} & {*sys.modules}
cr.plots.press_figures
assert "matplotlib.pyplot" not in sys.modules
"""


def test_libraries_are_imported_when_they_are_needed(tmp_path: Path) -> None:
    how: Any = dict(cwd=tmp_path, capture_output=True, text=True, check=False)
    done = subprocess.run([sys.executable, "-c", LAZY], **how)
    assert (done.returncode, done.stderr) == (0, "")
    assert all(name in done.stdout for name in ("verify", "new", "paper", "written to out"))


def test_every_public_name_is_there() -> None:
    assert all(hasattr(cr, name) for name in cr.__all__)
    assert set(cr.__all__) == set(dir(cr))
    with pytest.raises(AttributeError, match="pres"):
        _ = cr.pres
