"""What is run: which scenes, which solvers, how patiently."""

from __future__ import annotations

from dataclasses import dataclass

from convexrough.bench.measure import Attempt
from convexrough.bench.scenes import REFINEMENTS, Family
from convexrough.influence import Kind
from convexrough.solvers import BristleQP, Conic, ConicCVXPY, Newton

Sizes = tuple[tuple[Family, int], ...]


@dataclass(frozen=True)
class Plan:
    """Sizes are keys of `REFINEMENTS`.

    work     : where every solver is compared;  cost : where the default one is timed
    gradients : sizes of a gradient of the loss
    shear    : sizes of one shear state;  cycles : sizes of a loss curve, of `amplitudes` points
    paths    : sizes of a load path
    sweeps   : size, scenes, and numbers of processes
    patience : [s] to repeat a measurement for;  longest : [s] what would take longer is left out
    """

    work: Sizes
    cost: Sizes
    shear: Sizes
    cycles: Sizes
    paths: Sizes
    gradients: Sizes
    amplitudes: int
    patience: float
    longest: float
    quick: bool
    sweeps: tuple[tuple[int, int, tuple[int, ...]], ...] = ()


def full_plan() -> Plan:
    return Plan(
        work=(
            *_of("lattice", 61, 250, 700, 1_500, 8_400, 36_000, 330_000, 1_300_000),
            *_of("rough", 700, 36_000),
            *_of("scattered", 700, 8_400, 36_000),
        ),
        cost=(
            *_of("lattice", 13_000, 36_000, 120_000, 330_000, 1_300_000, 5_200_000),
            *_of("rough", 13_000, 36_000, 120_000, 330_000, 1_300_000),
            *_of("scattered", 13_000, 36_000, 120_000, 330_000),
        ),
        shear=_of("lattice", 61, 700, 8_400, 36_000, 120_000, 330_000),
        cycles=_of("lattice", 700, 8_400, 120_000),
        paths=(*_of("lattice", 61, 700, 8_400, 120_000), *_of("rough", 120_000)),
        gradients=_of("lattice", 700, 36_000, 330_000),
        amplitudes=50,
        patience=1.0,
        longest=20.0,
        quick=False,
        sweeps=((61, 10_000, (1, 2)), (250, 2_000, (1, 2)), (700, 500, (1, 2))),
    )


def quick_plan() -> Plan:
    return Plan(
        work=_of("lattice", 61, 700, 36_000, 330_000),
        cost=(
            *_of("lattice", 13_000, 36_000, 120_000, 330_000),
            *_of("rough", 13_000),
            *_of("scattered", 13_000),
        ),
        shear=_of("lattice", 61, 700),
        cycles=(),
        paths=_of("lattice", 61, 700),
        gradients=_of("lattice", 700, 36_000),
        amplitudes=50,
        patience=0.1,
        longest=4.0,
        quick=True,
        sweeps=((61, 300, (1,)),),
    )


def attempts(plan: Plan) -> list[Attempt]:
    """Every solver at several tolerances, those that end with a Newton step also without it."""
    powers = (2, 6, 12) if plan.quick else (2, 4, 8, 12)
    found = [
        Attempt("newton", "default", Newton(), growth=None),
        *(_newton("newton", power, None) for power in powers),
        *(_newton("newton, dense", power, "dense") for power in powers),
        *(_newton("newton, lattice", power, "lattice") for power in powers),
        *(_newton("newton, scattered", power, "scattered") for power in powers),
    ]
    cones = (3, 9) if plan.quick else (3, 6, 9, 11)
    for kind, label in ((Conic, "conic"), (ConicCVXPY, "conic in CVXPY")):
        for step in (True, False):
            for power in (9,) if step and plan.quick else cones:
                solver = kind(tolerance=10.0**-power, newton_step=step)
                found.append(Attempt(_stepped(label, step), _tolerance(power), solver))
    for step in (True, False):
        for bristles, power in ((16, 4), (64, 6)) if plan.quick else _BRISTLES:
            program = BristleQP(bristles, newton_step=step, tolerance=10.0**-power)
            setting = f"{bristles} bristles, {_tolerance(power)}"
            found.append(Attempt(_stepped("bristles", step), setting, program))
    return found


#: Of the time of Newton's method with the number of asperities, by coupling.
_GROWTH: dict[Kind, float] = {"dense": 2.5, "lattice": 1.2, "scattered": 1.3}

_BRISTLES = ((16, 4), (16, 6), (64, 4), (64, 6), (64, 8), (256, 6))


def _newton(label: str, power: int, kind: Kind | None) -> Attempt:
    growth = None if kind is None else _GROWTH[kind]
    return Attempt(label, _tolerance(power), Newton(tolerance=10.0**-power), kind, growth)


def _stepped(label: str, step: bool) -> str:
    return f"{label} + Newton step" if step else label


def _tolerance(power: int) -> str:
    return f"tolerance 1e-{power}"


def _of(family: Family, *sizes: int) -> Sizes:
    assert set(sizes) <= set(REFINEMENTS)
    return tuple((family, size) for size in sizes)
