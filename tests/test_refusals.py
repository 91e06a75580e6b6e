"""What is refused, with the reason; numbers that rest on an assumption that fails."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from friction_scenes import FRICTION, LARGEST, PAPER, pressed, with_friction
from scenes import MATERIAL, PAPER_APPROACH, hexagonal, paper

import convexrough as cr
from convexrough.bench.scenes import scene as bench_scene
from convexrough.friction.levels import FrictionLevels

CONTACT = pressed("paper")
LIMIT = FRICTION * CONTACT.load
LAST = cr.shear(CONTACT, force=LIMIT).displacement
BARE = cr.press(paper(), approach=PAPER_APPROACH)
LIFTED = cr.press(with_friction(paper()), approach=-1e-6)
PAIR = cr.Scene(1.0, cr.Asperities([[-0.0015, 0.0], [0.0015, 0.0]], 0.02), MATERIAL, FRICTION)
TOGETHER = cr.press(PAIR, load=1e-8)
P = LARGEST["paper"]
SWING = [0.5 * P, -0.5 * P]
HERTZ = cr.smooth(PAPER, load=CONTACT.load)
OTHER = cr.press(cr.Scene(1.0, cr.Asperities([[0.0, 0.0]], 1.0), MATERIAL), approach=1e-4)
ABOVE = cr.gallery.case("convexity-end-above")
TWO = pd.DataFrame({"x": [0.0, 1.0], "y": 0.0, "z": 0.0})


def follow(loads: Any, forces: Any, **options: Any) -> cr.LoadPath:
    return cr.load_path(PAPER, loads=loads, forces=forces, **options)


def swung(amplitudes: Any = SWING, load: float = P, **options: Any) -> cr.Shakedown:
    return cr.shakedown(PAPER, load=load, force_amplitudes=amplitudes, **options)


def around_in_phase(amplitude: Any) -> cr.PhaseLosses:
    given = dict(load_amplitude=amplitude, force_amplitude=0.1 * P, phases=[0.0])
    return cr.phase_losses(PAPER, load=P, **given)


BAD = [
    # Scenes.
    (lambda: cr.Material(0.0, 0.3), "contact_modulus: found 0.0, expected a positive number"),
    (lambda: cr.Material(1.0, 0.51), "poisson_ratio: found 0.51, expected a number from 0.0 to 0"),
    (lambda: cr.Asperities([], 1.0), "positions: found no asperity"),
    (lambda: cr.Asperities([[0, 0, 0]], 1.0), r"positions: found shape \(1, 3\)"),
    (lambda: cr.Asperities([[0, 0], [0, np.nan]], 1.0), r"positions\[1\]: found"),
    (lambda: cr.Asperities([[0, 1], [2, 3], [0, 1]], 1.0), r"asperities 0 and 2 \(from 0\) at a"),
    *((lambda size=size: cr.Asperities(size * np.eye(2), 1.0), "asperities 0 and 1 .* distance of")
      for size in (5e-61, 1e-130, 1e-160)),
    (lambda: cr.Asperities.square(spacing=1, tip_radius=1, within=1, height_std=1), "seed: found"),
    (lambda: cr.press(paper(), approach=1e-80), "choose other units"),
    (lambda: cr.Asperities.hexagonal(spacing=1e-9, tip_radius=1, within=1),
     r"within / spacing = 1e\+09: found 3.63e\+18 asperities .* memory"),
    (lambda: paper("tip"), "geometry: found 'tip'"),
    (lambda: cr.Scene(1, cr.Asperities([[2, 0], [3, 0]], [1, 2]), MATERIAL), "asperities 0 and 1"),
    (lambda: cr.verify(paper(), -np.ones(61), approach=5e-5), "is the sign reversed"),
    (lambda: cr.press(paper(), load=0.0), "load: found 0.0, expected a positive number"),
    (lambda: cr.press(paper()), "approach, load: found neither"),
    (lambda: cr.press(paper(), approach=1e-5, load=1e-5), "approach, load: found both"),
    # Memory is asked for so many before it is taken.
    (lambda: cr.press(hexagonal(2e-5, 1e-4), approach=5e-5, influence="dense"), "could touch"),
    (lambda: cr.certify(paper(), np.zeros(61)), "exactly one of the two"),
    (lambda: cr.certify(paper(), np.zeros(60), approach=5e-5), "expected 61 values"),
    (lambda: cr.certify(paper(), -np.ones(61), approach=5e-5), r"loads\[0\]: found -1.0"),
    # Shear.
    (lambda: cr.shear(CONTACT, force=1.01 * LIMIT), r"1\.01 f P: gross sliding"),
    (lambda: cr.shear(CONTACT, force=float("nan")), "found nan, expected a finite number"),
    (lambda: cr.shear(CONTACT, force=[1e-8, 2e-8]), "force"),
    (lambda: cr.shear(CONTACT, displacement=1.01 * LAST), "displacement"),
    (lambda: cr.shear(CONTACT, displacement=np.nan), "displacement"),
    (lambda: cr.shear(LIFTED, force=1e-9), "at most f P = 0"),
    (lambda: cr.shear(BARE, force=1e-9), "coefficient of friction"),
    (lambda: cr.cycle(BARE, maximum=0.0), "coefficient of friction"),
    (lambda: cr.cycle(CONTACT, maximum=1.1 * LIMIT), r"maximum\[0\].*gross sliding"),
    (lambda: cr.cycle(CONTACT, maximum=0.1 * LIMIT, minimum=0.2 * LIMIT), "at least the minimum"),
    (lambda: cr.history(CONTACT, forces=[0.0, -2 * LIMIT]), r"forces\[1\].*gross sliding"),
    (lambda: cr.cycle(CONTACT, maximum=LIMIT).loop(10**15), r"points: found 1e\+15 levels \("),
    # Vector friction.
    (lambda: cr.shear_vector(CONTACT, force=(LIMIT, 0.2 * LIMIT)), r"\(1\.0\d+ f P: gross slid"),
    (lambda: cr.shear_vector(CONTACT, force=(0.0, float("inf"))), "force"),
    (lambda: cr.shear_vector(BARE, force=1e-9), "coefficient of friction"),
    # Load paths.
    (lambda: follow([P, P], [0.0, 0.6 * P]), r"forces\[1\].*1\.2 f P: gross sliding"),
    (lambda: follow([P, -P], [0.0, 0.0]), r"loads\[1\].*not negative"),
    (lambda: follow([P, 0.0], [0.0, 1e-9 * P]), r"forces\[1\].*before contact is lost"),
    (lambda: follow([], []), "at least one"),
    (lambda: follow([P], [0.0], start=cr.press(replace(PAPER, friction=0.4), load=P)),
     "another scene"),
    (lambda: follow([P], [0.0], general_steps=0), "steps"),
    (lambda: follow([P], [0.0], solver="cone"), "one of newton, conic"),
    (lambda: follow([P, 1e-300 * P], [0.0, 0.0]), "largest"),
    (lambda: follow([1e-300 * P], [0.0], start=cr.press(PAPER, load=P)), "largest"),
    # Limits of shakedown.
    (lambda: swung([0.0, 0.0]), "force_amplitudes"),
    (lambda: swung([]), "force_amplitudes: found none"),
    (lambda: swung([np.nan, 1.0]), r"force_amplitudes\[0\].*finite"),
    (lambda: swung(load_amplitudes=[1e-9, 0, 0]), "load_amplitudes: .*expected 2 values, one p"),
    (lambda: swung([["a", 0.0]], kind="vector"), "force_amplitudes"),
    (lambda: swung(kind="plastic"), "kind"),
    (lambda: swung(load_amplitudes=[0.1 * P] * 2, kind="elastic"), r"load_amplitudes.*not .exact."),
    (lambda: swung(force=P), "force:"),
    (lambda: swung(kind="vector"), "shape"),
    (lambda: swung(load=-P), "load:"),
    (lambda: swung(np.ma.masked_less(SWING, 0)), "force_amplitudes: found 1 masked"),
    (lambda: swung(load_amplitudes=np.ma.masked_less(SWING, 0)), "load_amplitudes: found 1 mas"),
    (lambda: around_in_phase("1e-8"), "load_amplitude"),
    (lambda: around_in_phase([1e-8]), "load_amplitude"),
    # Derivatives.
    (lambda: LIFTED.gradient(load=1.0), "a contact with a load"),
    (lambda: cr.history(CONTACT, forces=[LIMIT]).gradient(losses=[1.0]), "in gross sliding"),
    (lambda: CONTACT.gradient(loads=[1.0, 2.0]), "61 values, one per asperity"),
    (lambda: cr.cycle(CONTACT, maximum=LIMIT).gradient(holding="approach"), "at constant approach"),
    (lambda: cr.cycle(TOGETHER, maximum=FRICTION * TOGETHER.load).gradient(),
     "several asperities slide last"),
    (lambda: cr.Objective(scene=PAPER, of="load", by=["heights"], approach=5e-5, force=1e-8),
     "force: found .*, expected none, as the load does"),
    (lambda: cr.onset_gradient(TOGETHER, 1), "asperity: found 1, which slides last, together with"),
    # The smooth sphere.
    *((lambda law=law: law(1.01 * LIMIT), r"1\.01 f P: gross sliding.*at most f P")
      for law in (HERTZ.displacement, HERTZ.stick_radius, HERTZ.energy)),
    (lambda: HERTZ.branch(0, 1.01 * LIMIT), r"1\.01 f P: gross sliding.*at most f P"),
    (lambda: HERTZ.traction(0.0, [0.0, -1.01 * LIMIT, 2 * LIMIT]), r"force\[1\].*gross sliding"),
    (lambda: HERTZ.energy(0.0, -2 * LIMIT), r"minimum: found.*gross sliding"),
    (lambda: HERTZ.energy(0.0, LIMIT / 2), r"maximum: found 0.*at least the minimum"),
    (lambda: HERTZ.displacement(np.nan), r"force: found nan"),
    (lambda: HERTZ.branch([0.0, 0.55 * LIMIT], LIMIT / 2), r"found.*at most the turning force"),
    (lambda: cr.smooth(paper(), load=0.0), r"load.*positive"),
    # Values of other types.
    (lambda: cr.press(PAPER.asperities, approach=5e-5), "scene: found type Asperities, expected"),
    (lambda: cr.press(cr.Scene, approach=5e-5), "scene: found the class Scene, expected a Scene"),
    (lambda: cr.press(PAPER, approach="5e-5"), "approach: found '5e-5', expected a finite number"),
    (lambda: cr.press(PAPER, approach=5e-5, solver=cr.solvers.Newton), "found <class .*Newton"),
    (lambda: cr.press(PAPER, approach=5e-5, solver="connic"), 'expected one of "newton", "conic"'),
    (lambda: cr.verify([0.0], PAPER, approach=5e-5), "scene: found type list, expected a Scene"),
    (lambda: cr.certify(PAPER, ["1"] * 61, approach=5e-5), r"loads: found \['1'.*expected numbers"),
    (lambda: cr.Scene("1", PAPER.asperities, PAPER.material), "sphere_radius: found '1'"),
    (lambda: cr.shear(PAPER, force=0.0), "contact: found type Scene, expected a Contact"),
    (lambda: cr.testing.assert_shear_certified(PAPER, [0.0], force=0.0), "expected a Contact"),
    (lambda: cr.Asperities(pd.DataFrame({"y": [0.0], "x": [1.0]}), 1.0), "found columns y, x"),
    (lambda: cr.certify(PAPER, np.ma.masked_less(np.ones(61), 2), load=1.0), "found 61 masked"),
    (lambda: cr.press(PAPER, approach=5e-5, start=CONTACT), "start: found type Contact, expected"),
    (lambda: cr.cycle(CONTACT, maximum=[1e-8, 2e-8]), "maximum: found shape .2,., expected one"),
    (lambda: cr.cycles(CONTACT, [1e-8, 2e-8], [1e-9]), "minimum: .*expected 2 values, one per max"),
    (lambda: cr.loops(cr.cycle(CONTACT, maximum=1e-8)), "cycles: found type Cycle, expected a"),
    (lambda: cr.load_path(CONTACT, loads=[1], forces=[0]), "scene: found type Contact"),
    (lambda: cr.shear_vector(CONTACT, force=1e-8, solver="conic"), "solver: found .conic., expec"),
    (lambda: cr.press_many(PAPER, load=1.0), "scenes: found type Scene, expected a list of scenes"),
    (lambda: cr.read_scene(5), "path: found 5, expected the name of a scene file"),
    (lambda: CONTACT.proof(sheared=[1e-8]), r"sheared\[0\]: found 1e-08, expected a shear state"),
    (lambda: CONTACT.proof(sheared=[cr.shear(CONTACT, force=0)]), r"sheared\[0\].*force 0,"),
    (lambda: CONTACT.proof(sheared=[cr.shear(TOGETHER, force=0)]), "a state of another contact"),
    (lambda: cr.solvers.Newton(max_iterations=1.5), "max_iterations: found 1.5, expected a whole"),
    (lambda: cr.solvers.Newton(tolerance=-1.0), "tolerance: found -1.0, expected a number that is"),
    (lambda: cr.solvers.Conic(max_iterations=-3), "max_iterations: found -3, expected a whole"),
    (lambda: cr.prove_order(CONTACT, most="a"), "most: found 'a', expected a whole number"),
    (lambda: cr.certify(PAPER, [1e99] * 61, load=1.0), r"found 1e\+99, .*, at most 1e\+60"),
    (lambda: cr.Asperities(TWO[["x", "y"]], 1.0, TWO["z"][::-1]), "heights: found another index"),
    (lambda: cr.certify(PAPER, pd.Series(np.ones(61))[::-1], load=1.0), "index in another order"),
    (lambda: PAPER.asperities.with_tips(pd.Series(np.ones(61))[::-1]), "index in another order"),
    (lambda: cr.press(PAPER, load=1.0, start=pd.Series(np.ones(61))[::-1]), "in another order"),
    (lambda: cr.Direction(heights=pd.Series(np.ones(61))[::-1]), "heights: found an index in an"),
    (lambda: cr.Direction(heights="abc"), "heights: found 'abc', expected numbers"),
    (lambda: PAPER.reach(np.nan), "approach: found nan, expected a finite number"),
    (lambda: cr.press(PAPER, load=np.complex128(1.0)), "load: found np.complex128"),
    (lambda: cr.press(PAPER, load=np.True_), "load: found np.True_"),
    (lambda: cr.Objective(scene=PAPER, of=["loss"], load=1.0, force=1.0), r"of: found \['loss'\]"),
    (lambda: cr.Objective(scene=PAPER, of="loss", by={"heights"}, load=1.0, force=1.0),
     "by: found {'heights'}, expected a list of names"),
    (lambda: cr.compare(PAPER), "approach, load: found neither"),
    (lambda: cr.Asperities(np.array([["0", "1"]]), 1.0), "found an array of str32, expected numb"),
    (lambda: cr.surface.read(5), "path: found 5, expected the name of a file with a map"),
    (lambda: cr.open_sweep(None), "folder: found None, expected the folder of a sweep"),
    (lambda: cr.plots.press_figures(5), "contact: found type int, expected a Contact"),
    (lambda: cr.plots.shear_figures(cr.shear(CONTACT, force=0.0)), "states: .*, expected a list"),
    (lambda: cr.plots.cycle_figures(5), "cycles: found 5, expected a list of cycles"),
    (lambda: cr.fields.traction(CONTACT, [0.0, 0.0]), "state: found type Contact, expected a She"),
    (lambda: cr.testing.assert_agree(CONTACT, CONTACT.loads), "scene: found none"),
    (lambda: cr.testing.assert_agree(CONTACT, OTHER), "second: found 1, expected as many"),
    (lambda: cr.testing.assert_agree(CONTACT, CONTACT, within=5), "within: found 5, expected a fr"),
    (lambda: cr.testing.assert_shear_certified(CONTACT, np.zeros(61), force=0.0, sliding=[1]),
     r"sliding: found shape \(1,\) of int64, expected"),
    (lambda: cr.testing.assert_certified(PAPER, -1.0, approach=5e-5), r"loads\[0\]: found -1"),
    (lambda: CONTACT.plot("load"), "axes: found type str, expected Axes"),
    (lambda: CONTACT.columns("loads", "load"), "columns: found 'load', expected some of stat"),
    (lambda: cr.testing.assert_agree(CONTACT, cr.shear(CONTACT, force=0)), "type ShearState, exp"),
    (lambda: cr.program(ABOVE.scene, **ABOVE.control), "cones: asperities too dense for a conv"),
    (lambda: (p := cr.program(PAPER, load=1e-7)).loads(p.data.linear * np.nan), r"values\[0\]"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "message"), BAD)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        call()
    assert isinstance(caught.value, cr.InputError)


def test_no_onset_where_an_indentation_falls() -> None:
    case = cr.gallery.case("losing-contact-after")
    contact = cr.press(replace(case.scene, friction=0.5), load=0.98 * case.control["load"])
    assert cr.prove_order(contact) == "fails"
    assert np.isnan(cr.onset_of_sliding(contact)).all()
    with pytest.raises(cr.ProofError, match="indentations may fall as the load rises"):
        cr.onset_gradient(contact, 0)


def test_gradients_of_losses_have_bounds_only_where_order_is_proved(monkeypatch: Any) -> None:
    contact = cr.press(bench_scene("scattered", 6.0), approach=5e-5)
    monkeypatch.setattr(FrictionLevels.order, "__defaults__", (0,))
    cycle = cr.cycle(contact, maximum=0.1 * contact.load)
    assert cycle.order == "proved for one step"
    gradient = cycle.gradient()
    assert np.isfinite(gradient.heights).all()
    assert gradient.value_error == np.inf
    assert np.isinf(gradient.height_errors[contact.loads > 0]).all()


def test_summits_of_a_map_stay_with_it(tmp_path: Path) -> None:
    surface = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1)
    summits = surface.summits()
    rougher = summits.roughened(height_std=1e-3, seed=1)
    assert type(rougher) is cr.Asperities
    assert "positions" in repr(rougher)
    contact = cr.press(cr.Scene(1e4, summits, MATERIAL), load=10.0)
    other, own = cr.surface.self_affine(0.8, 0.1, 32.0, seed=2).heights, surface.heights
    for heights in (other, own[::-1], np.rot90(own), own.T):
        with pytest.raises(cr.InputError, match="contact: found summits of another map"):
            cr.surface.press_whole(cr.surface.Surface(heights, surface.pixel), contact)
    plain = cr.press(cr.Scene(1e4, rougher, MATERIAL), load=10.0)
    with pytest.raises(cr.InputError, match="contact: found asperities that are no summits of a"):
        cr.surface.press_whole(surface, plain)
    named = cr.surface.Surface(surface.heights, surface.pixel, "µm").summits()
    with pytest.raises(cr.InputError, match="units: found summits in µm, expected"):
        cr.Scene(1e4, named, MATERIAL, units=("mm", "N"))
    assert len(cr.Scene(1e4, named, MATERIAL, units=("um", "N"))) == len(named)
