"""What cannot be sheared, followed, shaken down or differentiated is refused, with the reason."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from friction_scenes import FRICTION, pressed, with_friction
from path_scenes import LARGEST, PAPER
from scenes import MATERIAL, PAPER_APPROACH, paper

import convexrough as cr

CONTACT = pressed("paper")
LIMIT = FRICTION * CONTACT.load
LAST = cr.shear(CONTACT, force=LIMIT).displacement
BARE = cr.press(paper(), approach=PAPER_APPROACH)
LIFTED = cr.press(with_friction(paper()), approach=-1e-6)
PAIR = cr.Scene(1.0, cr.Asperities([[-0.0015, 0.0], [0.0015, 0.0]], 0.02), MATERIAL, FRICTION)
TOGETHER = cr.press(PAIR, load=1e-8)
P = LARGEST["paper"]
SWING = [0.5 * P, -0.5 * P]


def follow(loads: Any, forces: Any, **options: Any) -> cr.LoadPath:
    return cr.load_path(PAPER, loads=loads, forces=forces, **options)


def swung(amplitudes: Any = SWING, load: float = P, **options: Any) -> cr.Shakedown:
    return cr.shakedown(PAPER, load=load, force_amplitudes=amplitudes, **options)


def around_in_phase(amplitude: Any) -> cr.PhaseLosses:
    given = dict(load_amplitude=amplitude, force_amplitude=0.1 * P, phases=[0.0])
    return cr.phase_losses(PAPER, load=P, **given)


BAD = [
    (lambda: cr.shear(CONTACT, force=1.01 * LIMIT), r"1\.01 f P: gross sliding"),
    (lambda: cr.shear(CONTACT, force=float("nan")), "found nan, expected a finite number"),
    (lambda: cr.shear(CONTACT, force=[1e-8, 2e-8]), "force"),
    (lambda: cr.shear(CONTACT, displacement=1.01 * LAST), "displacement"),
    (lambda: cr.shear(CONTACT, displacement=np.nan), "displacement"),
    (lambda: cr.shear(LIFTED, force=1e-9), "at most f P = 0"),
    (lambda: cr.shear(BARE, force=1e-9), "coefficient of friction"),
    (lambda: cr.cycle(BARE, maximum=0.0), "coefficient of friction"),
    (lambda: cr.cycle(CONTACT, maximum=1.1 * LIMIT), r"maximum\[0\].*gross sliding"),
    (lambda: cr.cycle(CONTACT, maximum=0.1 * LIMIT, minimum=0.2 * LIMIT),
     r"maximum\[0\].*at least the minimum"),
    (lambda: cr.history(CONTACT, forces=[0.0, -2 * LIMIT]), r"forces\[1\].*gross sliding"),
    (lambda: cr.cycle(CONTACT, maximum=LIMIT).loop(10**15), r"points: found 1e\+15 levels \("),
    # Vector friction.
    (lambda: cr.shear_vector(CONTACT, force=1.01 * LIMIT), r"found .*\(1\.01 f P: gross sliding\)"),
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
    (lambda: swung(load_amplitudes=[1e-9, 0, 0]), "load_amplitudes: found 3 values, expected 2, o"),
    (lambda: swung([["a", 0.0]], kind="vector"), "force_amplitudes"),
    (lambda: swung(np.zeros((0, 2)), kind="vector"), "force_amplitudes"),
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
    (lambda: cr.history(CONTACT, forces=[LIMIT]).gradient(losses=[1.0]),
     "in gross sliding a history has no derivative"),
    (lambda: CONTACT.gradient(loads=[1.0, 2.0]), "61 values, one per asperity"),
    (lambda: cr.cycle(CONTACT, maximum=LIMIT).gradient(holding="approach"),
     "at constant approach f P may fall below"),
    (lambda: cr.cycle(TOGETHER, maximum=FRICTION * TOGETHER.load).gradient(),
     "several asperities slide last"),
    (lambda: cr.onset_gradient(TOGETHER, 1),
     "asperity: found 1, which slides last, together with"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "message"), BAD)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(cr.InputError, match=message):
        call()
