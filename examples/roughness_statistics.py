"""Compute statistics of the energy loss of many surfaces with random heights and tip radii.

With equal asperities a rough contact loses less energy than a smooth sphere at small shear forces,
and more at large ones. The amplitude at which both lose the same is called the crossing here. Dini
and Hills (2009) found it for their example, and named "variation in asperity heights and tip radii"
as the next step. This script takes that step: each surface is random, pressed with one load, and
cycled at many amplitudes; all states are certified.

    python examples/roughness_statistics.py 10000 bands.png     # number of surfaces, and the figure

With 10,000 surfaces the median of the crossing is near that of equal asperities, 0.385 of f P. But
it varies between surfaces: with a standard deviation of the heights of 1e-6 R (2 % of the
approach), 90 % of the surfaces have it between 0.32 and 0.49. From 2e-6 R on, some surfaces have no
crossing, and at 4e-6 R 45 % have none: their lightly loaded asperities slide at small forces, and
they lose more than the smooth sphere at every amplitude. With equal heights and tip radii that vary
by 20 %, the crossing is between 0.37 and 0.42.

The reference values are the crossings of the array of equal asperities and of one random surface,
by bisection, and their losses computed without shear, from the curve of approach against load.
"""

import sys
from concurrent.futures import Executor, ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

import convexrough as cr

Pairs = list[tuple[str, float, float]]
Array = NDArray[np.float64]

LOAD, FRICTION, NU = 3.6e-7, 0.5, 0.3
SPREADS = (0.0, 5e-7, 1e-6, 2e-6, 4e-6)
TIPS = (0.0, 0.2)
AMPLITUDES = tuple(round(0.05 + 0.02 * i, 2) for i in range(46))
LOSSES = [f"loss_over_smooth_{x!r}" for x in AMPLITUDES]


def sweep_tables(surfaces: int) -> dict[str, Any]:
    """Tables of a sweep over about this number of surfaces, equally many for each spread."""
    return {
        "sphere": {"radius": 1.0},
        "material": {"contact_modulus": 1.0, "poisson_ratio": NU},
        "asperities": {
            "pattern": "hexagonal",
            "spacing": 0.0025,
            "tip_radius": 0.02,
            "within": 0.0152,
            "geometry": "summit",
        },
        "normal": {"load": LOAD},
        "friction": {"coefficient": FRICTION},
        "cycle": {"maximum_fraction": list(AMPLITUDES)},
        "sweep": {
            "seeds": max(1, surfaces // (len(SPREADS) * len(TIPS))),
            "measure": ["loss", "loss_over_smooth"],
            "over": {
                "asperities.tip_radius_cv": list(TIPS),
                "asperities.height_std": list(SPREADS),
            },
        },
    }


def crossings(ratios: Array) -> Array:
    """(n,) the largest amplitude at which each curve (n, m) of loss over smooth loss is 1, or nan.

    Between the points, the logarithms are interpolated by monotone cubics.
    """
    found = np.full(len(ratios), np.nan)
    x = np.log(AMPLITUDES)
    for i, ratio in enumerate(ratios):
        roots = PchipInterpolator(x, np.log(ratio)).roots(extrapolate=False)
        if len(roots):
            found[i] = float(np.exp(roots[-1]))
    return found


def surface(height_std: float, tip_radius_cv: float, seed: int) -> cr.Contact:
    """The pressed contact of one of the surfaces."""
    asperities = cr.Asperities.hexagonal(
        spacing=0.0025,
        tip_radius=0.02,
        within=0.0152,
        height_std=height_std,
        tip_radius_cv=tip_radius_cv,
        seed=seed,
    )
    return cr.press(
        cr.Scene(1.0, asperities, cr.Material(1.0, NU), FRICTION, geometry="summit"), load=LOAD
    )


def crossing_by_bisection(contact: cr.Contact) -> float:
    """The amplitude at which the loss of a cycle equals that of the smooth sphere."""

    def beyond(amplitude: float) -> float:
        cycle = cr.cycle(contact, maximum=amplitude * FRICTION * contact.load)
        return float(np.log(cycle.loss_normalised / cycle.smooth_normalised))

    return float(brentq(beyond, 0.2, 0.9, xtol=1e-10))


def loss_from_indentation(contact: cr.Contact, amplitude: float) -> float:
    """8 c_t f^2 times the trapezoid error of D0 over the loads from (1 - amplitude) P to P."""
    ratio = (2 - NU) / (2 * (1 - NU))
    nodes, weights = np.polynomial.legendre.leggauss(32)
    half = amplitude * LOAD / 2
    loads = LOAD - half + half * nodes
    area = half * weights @ [cr.press(contact.scene, load=load).approach for load in loads]
    ends = [cr.press(contact.scene, load=load).approach for load in ((1 - amplitude) * LOAD, LOAD)]
    return float(8 * ratio * FRICTION**2 * (area - half * sum(ends)))


def measured(surfaces: int, executor: Executor | None = None) -> cr.SweepTable:
    table = cr.sweep(sweep_tables(surfaces), executor=executor)
    assert set(table.read(["status"])["status"]) == {"certified"}
    return table


def compare() -> Pairs:
    """Return (quantity, computed value, reference value), from few surfaces."""
    with ThreadPoolExecutor(1) as here:  # starting processes takes longer than 20 surfaces
        columns = measured(20, here).read()
    ratios = np.column_stack([columns[name] for name in LOSSES])
    pairs = []
    found = crossings(ratios)
    for row in (0, len(ratios) - 3):
        parameters = columns["asperities.height_std"][row], columns["asperities.tip_radius_cv"][row]
        contact = surface(*parameters, int(columns["seed"][row]))
        name = f"heights {parameters[0]:g}, tips {parameters[1]:g}, seed {columns['seed'][row]}"
        pairs.append((f"crossing, {name}", found[row], crossing_by_bisection(contact)))
        amplitude = 0.75
        loss = columns[f"loss_{amplitude!r}"][row]
        reference = loss_from_indentation(contact, amplitude)
        pairs.append((f"loss at {amplitude} over that of the curve, {name}", loss / reference, 1.0))
    return pairs


def draw(table: cr.SweepTable, path: str) -> None:
    """Draw the loss, over that of the smooth sphere, against amplitude; and the crossing."""
    from matplotlib.figure import Figure

    columns = table.read()
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    ratios = np.column_stack([columns[name] for name in LOSSES])
    looks = {0.0: ("0.25", "-"), 1e-6: ("#2b5c8a", "--"), 4e-6: ("#c1440e", ":")}
    equal = columns["asperities.tip_radius_cv"] == 0
    for spread, (colour, line) in looks.items():
        rows = ratios[equal & (columns["asperities.height_std"] == spread)]
        low, middle, high = np.quantile(rows, (0.05, 0.5, 0.95), axis=0)
        left.fill_between(AMPLITUDES, low, high, color=colour, alpha=0.2, lw=0)
        left.plot(AMPLITUDES, middle, color=colour, ls=line, label=f"{spread * 1e6:g}")
    left.axhline(1.0, color="0.6", lw=0.8)
    left.set(xlabel="$Q_a / fP$", ylabel="loss / loss of the smooth sphere")
    left.legend(title="height std / $10^{-6} R$", frameon=False)
    where = crossings(ratios)
    for cv, colour, shift in ((0.0, "#2b5c8a", -0.06), (0.2, "#c1440e", 0.06)):
        bands = []
        for spread in SPREADS:
            rows = (columns["asperities.tip_radius_cv"] == cv) & (
                columns["asperities.height_std"] == spread
            )
            bands.append(np.nanquantile(where[rows], (0.05, 0.5, 0.95)))
        low, middle, high = np.array(bands).T
        x = np.array(SPREADS) * 1e6 + shift
        right.errorbar(
            x, middle, (middle - low, high - middle), color=colour, marker="so"[cv == 0], ms=4,
            ls="-" if cv == 0 else "--", capsize=3, label=f"{cv:.0%}",
        )  # fmt: skip
    right.set(xlabel="height std / $10^{-6} R$", ylabel="$Q_a / fP$ of the crossing")
    right.legend(title="spread of tip radii", frameon=False)
    figure.savefig(path, dpi=200)


if __name__ == "__main__":
    table = measured(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
    columns = table.read()
    where = crossings(np.column_stack([columns[name] for name in LOSSES]))
    print(f"{len(table):,} surfaces; crossing of rough and smooth loss, Q/(fP): 5 %, 50 %, 95 %")
    for cv in TIPS:
        for spread in SPREADS:
            rows = (columns["asperities.tip_radius_cv"] == cv) & (
                columns["asperities.height_std"] == spread
            )
            low, middle, high = np.nanquantile(where[rows], (0.05, 0.5, 0.95))
            never = np.isnan(where[rows]).mean()
            print(f"heights {spread:<6g} tips {cv:<4g} {low:.3f} {middle:.3f} {high:.3f} "
                  f" without a crossing {never:.1%}")  # fmt: skip
    if len(sys.argv) > 2:
        draw(table, sys.argv[2])
    for name, computed, reference in compare():
        print(f"{name:<72} {computed:10.8f} {reference:10.8f}")
