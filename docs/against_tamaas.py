"""convexrough beside tamaas, at the same number of unknowns and the same relative residual.

    python docs/against_tamaas.py [UNKNOWNS ...]

in an environment that has both packages (pip install tamaas); neither needs the other. One sphere
is pressed on a half-space in free space with a given load, in both with about half of the unknowns
in contact:

- tamaas: a smooth sphere on n square pixels under uniform pressure, by the conjugate gradients of
  Polonsky, Keer and Rey with its non-periodic operator ("dcfft");
- convexrough: the same sphere on a hexagonal lattice of n asperities, by its default solver, with
  the certificate and without it.

These are two models, not one: the unknowns are equal in number, as is the convolution that couples
them. The residual of both is that of the contact law,

    max_i ( |g_i| where loaded,  max(-g_i, 0) where not )  /  approach,

with the gaps g computed from the loads by the package's own operator, and the approach that fits
them best. tamaas stops by a criterion of its own (pressure times gap, over both their sizes), so
its tolerance is lowered tenfold until the residual is at most 1e-8, and only runs with the last
tolerance count. Newton's method is not stopped early: it ends at rounding, and its residual is
printed.
"""

import os
import platform
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

import convexrough as cr
from convexrough.normal.problem import NormalProblem

RESIDUAL = 1e-8
PATIENCE = 20.0  # seconds
UNKNOWNS = (65_536, 262_144, 1_048_576)
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


def by_tamaas(n: int) -> dict[str, float]:
    """A smooth sphere of radius 1 and E* = 1 on about n pixels; half of them in contact."""
    import tamaas as tm

    tm.set_log_level(tm.LogLevel.error)
    side = round(np.sqrt(n))
    length = np.sqrt(np.pi) * REACH  # the area of the asperities
    centres = (np.arange(side) + 0.5) / side * length - length / 2
    x, y = np.meshgrid(centres, centres, indexing="ij")
    sphere = -(x**2 + y**2) / 2
    a = REACH / np.sqrt(2)  # contact radius of the smooth sphere at this approach
    mean = 4 / 3 * a**3 / length**2

    def solve(tolerance: float) -> tuple[Any, Any]:
        model = tm.ModelFactory.createModel(tm.model_type.basic_2d, [length, length], [side, side])
        model.E, model.nu = 1.0, 0.0  # E* = E / (1 - nu^2)
        tm.ModelFactory.registerNonPeriodic(model, "dcfft")
        solver = tm.PolonskyKeerRey(model, sphere, tolerance)
        solver.setIntegralOperator("dcfft")
        solver.max_iter = 20_000
        solver.solve(mean)
        return model, solver

    tolerance = 1e-6
    while True:
        (model, _), seconds = timed(partial(solve, tolerance))
        pressure = np.array(model.traction)
        displacement = np.zeros_like(pressure)
        model.operators["dcfft"](pressure, displacement)
        gap = displacement - sphere
        approach = float((pressure * gap).sum() / pressure.sum())
        gap -= approach
        bad = np.where(pressure > 0, np.abs(gap), np.maximum(-gap, 0))
        residual = float(bad.max()) / approach
        if residual <= RESIDUAL or tolerance < 1e-30:
            break
        tolerance /= 10
    return {
        "unknowns": side * side,
        "loaded": int((pressure > 0).sum()),
        "seconds": seconds,
        "residual": residual,
        "tolerance": tolerance,
        "load": float(pressure.sum()) * length**2 / side**2,
        "approach": approach,
    }


def by_convexrough(n: int) -> dict[str, float]:
    """About n asperities, all of which could touch."""
    spacing = REACH * np.sqrt(2 * np.pi / np.sqrt(3) / n)
    asperities = cr.Asperities.hexagonal(spacing=spacing, tip_radius=8 * spacing, within=REACH)
    scene = cr.Scene(1.0, asperities, cr.Material(contact_modulus=1.0, poisson_ratio=0.0))
    load = cr.press(scene, approach=APPROACH).load  # also loads the code
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
        "residual": solution.residual / solution.approach,
        "load": contact.load,
        "approach": contact.approach,
        "certified": contact.certificate.holds,
    }


def main() -> None:
    import tamaas

    sizes = [int(each) for each in sys.argv[1:]] or list(UNKNOWNS)
    threads = os.environ.get("OMP_NUM_THREADS", "not limited")
    print(
        f"convexrough {cr.__version__}, tamaas {tamaas.__version__}, {platform.machine()}, "
        f"{os.cpu_count()} cores, OMP_NUM_THREADS {threads}, load average {os.getloadavg()[0]:.2f}"
    )
    heading = "{:>9} {:>9} {:>9} {:>9} {:>9} | {:>9} {:>9} {:>9} {:>9} {:>9} | {:>6} {:>6}"
    row = (
        "{:>9,} {:>9,} {:>9.3g} {:>9.1e} {:>9.0e} | {:>9,} {:>9,} {:>9.3g} {:>9.3g} {:>9.1e} | "
        "{:>6.1f} {:>6.1f}"
    )
    print("{:-^49} | {:-^49} | ratio of times".format(" tamaas ", " convexrough "))
    names = ("unknowns", "loaded", "seconds", "residual")
    print(
        heading.format(*names, "its tol.", *names[:3], "certified", "residual", "solved", "proved")
    )
    for n in sizes:
        ours, theirs = by_convexrough(n), by_tamaas(n)
        print(
            row.format(
                *(theirs[name] for name in (*names, "tolerance")),
                *(ours[name] for name in ("unknowns", "loaded", "seconds", "press", "residual")),
                theirs["seconds"] / ours["seconds"],
                theirs["seconds"] / ours["press"],
            ),
            flush=True,
        )


if __name__ == "__main__":
    main()
