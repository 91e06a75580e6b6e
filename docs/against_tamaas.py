"""convexrough beside tamaas and ContactMechanics, at as many unknowns and the same residual.

    python docs/against_tamaas.py [UNKNOWNS ...]

in an environment that has the packages (pip install tamaas ContactMechanics; those that are not
there are left out); none needs the others. One sphere is pressed on a half-space in free space with
a given load, in all with about half of the unknowns in contact:

- tamaas: a smooth sphere on n square pixels under uniform pressure, by the conjugate gradients of
  Polonsky, Keer and Rey with its non-periodic operator ("dcfft");
- ContactMechanics: the same, by the conjugate gradients of Polonsky and Keer with its free-space
  operator, one thread;
- convexrough: the same sphere on a hexagonal lattice of n asperities, by its default solver, with
  the certificate and without it; and from nothing, with the certificate: the scene made, and its
  first press.

These are two models, not one: the unknowns are equal in number, as is the convolution that couples
them. The residual of all is that of the contact law,

    max_i ( |g_i| where loaded,  max(-g_i, 0) where not )  /  approach,

with the gaps g computed from the loads by the package's own operator, and the approach that fits
them best. The others stop by criteria of their own (tamaas: pressure times gap, over both their
sizes; ContactMechanics: the largest penetration, over the approach), so their tolerance is lowered
tenfold until the residual is at most 1e-8, and only runs with the last tolerance count. Newton's
method is not stopped early: it ends at rounding, and its residual is printed.
"""

import os
import platform
import sys
import time
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from importlib.util import find_spec
from typing import Any

import numpy as np

import convexrough as cr
from convexrough.normal.problem import NormalProblem

RESIDUAL = 1e-8
PATIENCE = 20.0  # seconds
UNKNOWNS = (16_384, 65_536, 262_144, 1_048_576)
REACH = 0.01  # of the asperities, over the sphere's radius
APPROACH = REACH**2 / 2  # what just reaches the last of them


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """What it returns, and the least seconds of up to three runs."""
    times: list[float] = []
    while len(times) < 3 and sum(times) < PATIENCE:
        began = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - began)
    return result, min(times)


#: The area of the asperities, and the load of the smooth sphere at this approach; R = E* = 1.
LENGTH = np.sqrt(np.pi) * REACH
LOAD = 4 / 3 * (REACH / np.sqrt(2)) ** 3


def sphere_on(side: int) -> Any:
    """Heights (side, side) of a smooth sphere; about half of it will touch."""
    centres = (np.arange(side) + 0.5) / side * LENGTH - LENGTH / 2
    x, y = np.meshgrid(centres, centres, indexing="ij")
    return -(x**2 + y**2) / 2


def until_accurate(
    side: int, tolerance: float, solve: Callable[[float], Any], field: Callable[[Any], Any]
) -> dict[str, float]:
    """solve(tolerance), the tolerance lowered until the residual is small enough.

    field : of what was solved, the loads (side, side) and the displacement that they cause
    """
    sphere = sphere_on(side)
    while True:
        solved, seconds = timed(partial(solve, tolerance))
        loads, displacement = field(solved)
        gap = displacement - sphere
        approach = float((loads * gap).sum() / loads.sum())
        gap -= approach
        bad = np.where(loads > 0, np.abs(gap), np.maximum(-gap, 0))
        residual = float(bad.max()) / approach
        if residual <= RESIDUAL or tolerance < 1e-30:
            break
        tolerance /= 10
    return {
        "unknowns": side * side,
        "loaded": int((loads > 0).sum()),
        "seconds": seconds,
        "residual": residual,
        "tolerance": tolerance,
        "load": float(loads.sum()),
        "approach": approach,
    }


def by_contact_mechanics(n: int) -> dict[str, float]:
    """A smooth sphere of radius 1 and E* = 1 on about n pixels; half of them in contact."""
    from ContactMechanics import FreeFFTElasticHalfSpace
    from ContactMechanics.Optimization import constrained_conjugate_gradients
    from SurfaceTopography import Topography

    side = round(np.sqrt(n))
    topography = Topography(sphere_on(side), (LENGTH, LENGTH))
    substrate = FreeFFTElasticHalfSpace((side, side), 1.0, (LENGTH, LENGTH))

    def solve(tolerance: float) -> Any:
        return constrained_conjugate_gradients(
            substrate,
            topography,
            external_force=LOAD,
            pentol=tolerance * APPROACH,
            maxiter=20_000,
        )

    def field(solved: Any) -> tuple[Any, Any]:
        return solved.jac, -substrate.evaluate_disp(solved.jac)

    return until_accurate(side, 1e-6, solve, field)


def by_tamaas(n: int) -> dict[str, float]:
    """A smooth sphere of radius 1 and E* = 1 on about n pixels; half of them in contact."""
    import tamaas as tm

    tm.set_log_level(tm.LogLevel.error)
    side, length = round(np.sqrt(n)), LENGTH
    sphere, mean = sphere_on(side), LOAD / length**2

    def solve(tolerance: float) -> tuple[Any, Any]:
        model = tm.ModelFactory.createModel(tm.model_type.basic_2d, [length, length], [side, side])
        model.E, model.nu = 1.0, 0.0  # E* = E / (1 - nu^2)
        tm.ModelFactory.registerNonPeriodic(model, "dcfft")
        solver = tm.PolonskyKeerRey(model, sphere, tolerance)
        solver.setIntegralOperator("dcfft")
        solver.max_iter = 20_000
        solver.solve(mean)
        return model, solver

    def field(solved: Any) -> tuple[Any, Any]:
        model, _ = solved
        pressure = np.array(model.traction)
        displacement = np.zeros_like(pressure)
        model.operators["dcfft"](pressure, displacement)
        return pressure * (length / side) ** 2, displacement

    return until_accurate(side, 1e-6, solve, field)


def by_convexrough(n: int) -> dict[str, float]:
    """About n asperities, all of which could touch."""
    spacing = REACH * np.sqrt(2 * np.pi / np.sqrt(3) / n)

    def made() -> cr.Scene:
        lattice = cr.Asperities.hexagonal(spacing=spacing, tip_radius=8 * spacing, within=REACH)
        return cr.Scene(
            1.0, lattice, cr.Material(contact_modulus=1.0, poisson_ratio=0.0), geometry="summit"
        )

    load = cr.press(made(), approach=APPROACH).load  # also loads the code
    _, first = timed(lambda: cr.press(made(), load=load))
    scene = made()
    contact, pressing = timed(lambda: cr.press(scene, load=load))

    def solve() -> tuple[NormalProblem, Any]:
        problem = NormalProblem.assemble(scene, load=load)
        return problem, cr.solvers.Newton().solve(problem)

    (problem, solution), seconds = timed(solve)
    return {
        "unknowns": len(problem),
        "loaded": int((solution.loads > 0).sum()),
        "seconds": seconds,
        "press": pressing,
        "first": first,
        "residual": solution.residual / solution.approach,
        "load": contact.load,
        "approach": contact.approach,
        "certified": contact.certificate.all_proved,
    }


OTHERS = {"tamaas": by_tamaas, "ContactMechanics": by_contact_mechanics}


def main() -> None:
    sizes = [int(each) for each in sys.argv[1:]] or list(UNKNOWNS)
    threads = os.environ.get("OMP_NUM_THREADS", "not limited")
    print(
        f"convexrough {cr.__version__}, {platform.machine()}, {os.cpu_count()} cores, "
        f"OMP_NUM_THREADS {threads}, load average {os.getloadavg()[0]:.2f}"
    )
    there = {name: solve for name, solve in OTHERS.items() if find_spec(name) is not None}
    for name in there:
        print(f"{name} {version(name)}")
    columns = "{:>17} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} | {:>6} {:>6} {:>6}"
    print(
        columns.format(
            *("", "unknowns", "loaded", "seconds", "certified", "first", "residual"),
            *("solved", "proved", "first"),
        )
    )
    counts, times = "{:,}".format, "{:.3g}".format
    for n in sizes:
        ours = by_convexrough(n)
        cells = [counts(ours["unknowns"]), counts(ours["loaded"]), times(ours["seconds"])]
        cells += [times(ours["press"]), times(ours["first"]), f"{ours['residual']:.1e}"]
        print(columns.format("convexrough", *cells, "", "", ""), flush=True)
        for name, solve in there.items():
            theirs = solve(n)
            cells = [counts(theirs["unknowns"]), counts(theirs["loaded"])]
            cells += [times(theirs["seconds"]), "-", "-", f"{theirs['residual']:.1e}"]
            cells += [
                f"{theirs['seconds'] / ours[key]:.1f}" for key in ("seconds", "press", "first")
            ]
            print(columns.format(name, *cells), flush=True)


if __name__ == "__main__":
    main()
