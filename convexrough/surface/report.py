"""The output of the command `summits`: printed text, JSON and tables."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter

from convexrough.contact import Contact
from convexrough.errors import SolverError
from convexrough.plausibility import FEW
from convexrough.progress import LOGGER
from convexrough.record import rows_of
from convexrough.scene.base import along
from convexrough.surface.boundary_elements import Whole, press_whole
from convexrough.surface.detrend import principal
from convexrough.surface.provability import LEVELS, Press, Provability, crowded, provability
from convexrough.surface.summits import Summits
from convexrough.surface.surface import Surface
from convexrough.tabular.columns import aligned, labelled
from convexrough.tabular.roles import shortened
from convexrough.tabular.units import in_unit
from convexrough.version import __version__

#: The units of columns and statistics; {} stands for the unit of length.
LENGTHS = dict.fromkeys(("x", "y", "height", "tip_radius", "prominence", "deviation"), "{}")
LENGTHS |= dict.fromkeys(("largest_curvature", "smallest_curvature", "mean_curvature"), "1/{}")
LENGTHS |= {"density": "1/{}²", "mean_height": "{}", "height_std": "{}"}

#: At most this many crowded pairs of summits, and unused comments, are printed.
MOST_LISTED = 10

#: A contact farther from the middle than this fraction of the half width causes a warning.
NEAR_EDGE = 0.9

#: [degrees] Axes of a form that are nearer to x and y than this count as along x and y.
TURNED = 1.0

#: Largest relative difference without a warning: between a statistic of the summits and its value
#: for a Gaussian surface, and between the loads of the asperities and of the whole map.
UNLIKE = 0.2


@dataclass(frozen=True)
class Scanned:
    """A surface, its summits, and the results of pressing them."""

    surface: Surface
    maxima: Summits  # all summits
    summits: Summits  # those left by pruning
    curve: Provability | None = None  # contacts at several prunings; None if nothing was pressed
    contact: Contact | None = None  # of `summits`; None if no solution was found, either
    whole: Whole | None = None  # contact of the whole map by boundary elements

    @classmethod
    def of(
        cls, surface: Surface, prune: float, fit: int, press: Press | None, *, whole: bool = False
    ) -> Scanned:
        """The summits of a surface, pressed by `press`; with `whole` also the whole map."""
        LOGGER.info("finding summits")
        maxima, summits = surface.summits(0.0, fit), surface.summits(prune, fit)
        if press is None:
            return cls(surface, maxima, summits)
        curve, contact = provability(maxima, press, levels=[*LEVELS, prune]), None
        with suppress(SolverError):
            contact = press(summits)
        pressed = press_whole(surface, contact) if whole and contact is not None else None
        return cls(surface, maxima, summits, curve, contact, pressed)

    @property
    def certified(self) -> bool:
        """True if nothing was pressed, or if the contact is certified."""
        found = self.contact
        return self.curve is None or (found is not None and found.certificate.all_proved)


def surface_summary(scanned: Scanned) -> dict[str, Any]:
    """The object that `--json` prints, with lengths in the unit of the map."""
    surface, summits, origin = scanned.surface, scanned.summits, scanned.summits.origin
    moments, statistics = surface.moments, scanned.maxima.statistics
    summary: dict[str, Any] = {
        "schema": 2,
        "version": __version__,
        "surface": {
            **_named(surface, "source", "comments"),
            **_named(origin, "shape", "pixel", "unit", "level"),
            "removed": [asdict(it) | _named(it, "curvature", "radius") for it in surface.removed],
            **_named(surface, "filled", "max_height", "rms_height", "rms_slope"),
        },
        "summits": {
            "count": len(summits),
            **_named(origin, "maxima", "pruned", "at_edge", "without_top", "prune", "threshold"),
            "fit": origin.fit,
        },
        "statistics": {
            "all": statistics._asdict(),
            "pruned": summits.statistics._asdict(),
            "moments": _named(moments, *statistics._fields, "m0", "m2", "m4", "bandwidth"),
        },
    }
    if scanned.curve is not None:
        summary["provability"] = rows_of(scanned.curve.columns())
        summary["trusted_from"] = scanned.curve.trusted_from
    if scanned.contact is not None:
        pairs, values = crowded(scanned.contact)
        summary["crowded"] = rows_of({"summits": pairs, "crowding": values})
    if (form := with_form(scanned)) is not None:
        summary["with_form"] = {"radii": form[0], "angle": form[1]}
    if scanned.whole is not None:
        summary["whole"] = {
            name: {"asperities": model, "whole": whole}
            for name, model, whole in scanned.whole.compared()
        } | {"resolution": scanned.whole.resolution}
    return summary


def _named(found: object, *names: str) -> dict[str, Any]:
    return {name: getattr(found, name) for name in names}


def summit_columns(summits: Summits) -> dict[str, Any]:
    """The columns of summits.csv, with units in their names; a scene file can read the file."""
    columns = {_in_unit(name, summits.unit): it for name, it in summits.columns().items()}
    return columns | {"row": summits.pixels[:, 0], "column": summits.pixels[:, 1]}


def _in_unit(name: str, unit: str) -> str:
    return in_unit(name, LENGTHS.get(name, "").format(unit) if unit else "")


def describe_surface(scanned: Scanned) -> list[str]:
    """The printed report of `summits`, in aligned lines."""
    surface, summits, origin = scanned.surface, scanned.summits, scanned.summits.origin
    unit = f" {surface.unit}" if surface.unit else ""
    (rows, columns), (dx, dy), tips = origin.shape, surface.pixel, summits.tip_radii
    left_out = {"pruned": origin.pruned, "at the edge": origin.at_edge,
                "without a fitted maximum": origin.without_top}  # fmt: skip
    left = ", ".join(f"{count:,} {why}" for why, count in left_out.items())
    unused = [f'"{shortened(each.strip("#% "))}"' for each in surface.comments]
    more = f" and {len(unused) - MOST_LISTED:,} more" if len(unused) > MOST_LISTED else ""
    lines: dict[str, object] = {
        "surface": surface.source,
        "comments": unused and f"not used: {', '.join(unused[:MOST_LISTED])}{more}",
        "pixels": f"{columns:,} by {rows:,}, each {dx:.6g} by {dy:.6g}{unit}",
        "removed": "; ".join(map(str, surface.removed))
                   or f"nothing; the mean height is {origin.level:.6g}{unit}",
        "pressing radius": _pressed_by(scanned),
        "holes filled": surface.filled and f"{surface.filled:,}",
        "heights": f"Sz {surface.max_height:.4g}{unit}, Sq {surface.rms_height:.4g}{unit}, "
                   f"rms slope {surface.rms_slope:.3g}",
        "pruning": f"{100 * origin.prune:.3g} % of Sz, {origin.threshold:.4g}{unit}  (Wolf)",
        "summits": f"{len(summits):,}  (of {origin.maxima:,} maxima: {left})",
        "tip radius": f"median {np.median(tips):.4g}{unit}, {tips.min():.4g} to {tips.max():.4g}"
                      f"  (paraboloids over {origin.fit} by {origin.fit} pixels)",
        "eccentricity": f"median {np.median(summits.eccentricities):.2f}, largest "
                        f"{summits.eccentricities.max():.2f}  (elliptic tips carry up to "
                        f"{100 * (summits.elliptic_loads.max() - 1):.2g} % more than spheres)",
        "rms misfit": f"median {np.median(summits.deviations):.2g}{unit}, largest "
                      f"{summits.deviations.max():.2g}  (distance of pixels from the sphere)",
        "bandwidth": f"{surface.moments.bandwidth:.3g}  (m0 {surface.moments.m0:.4g}, "
                     f"m2 {surface.moments.m2:.4g}, m4 {surface.moments.m4:.4g})",
    }  # fmt: skip
    found = scanned.maxima.statistics, summits.statistics, surface.moments
    table: list[Any] = [["statistics", "all maxima", "after pruning", "from moments"]]
    for name in found[0]._fields:
        named = _in_unit(name, surface.unit).replace("_", " ")
        table.append([named, *(getattr(each, name) for each in found)])
    described = labelled((name, str(said)) for name, said in lines.items() if said)
    described += ["", *aligned(table, left=1, digits=4)]
    if scanned.curve is not None:
        force = scanned.contact.scene.units.force if scanned.contact is not None else ""
        described += ["", *_describe_curve(scanned.curve, surface.unit, force)]
    if scanned.contact is not None:
        described += _describe_crowded(scanned.contact)
    if scanned.whole is not None:
        table = [["at one approach", "asperities", "whole map", "difference"]]
        table += [[*each, f"{each[1] / each[2] - 1:+.1%}"] for each in scanned.whole.compared()]
        described += ["", *aligned(table, left=1)]
        change = f"{100 * scanned.whole.resolution:.2g} %"
        described += labelled([("resolution", f"pixels twice as wide change the load by {change}")])
    return described


def with_form(scanned: Scanned) -> tuple[tuple[float, float], float] | None:
    """The radii of a body with the shape of the pressing body plus the removed forms, that of the
    axis nearer to x first, and the angle [degrees] from x to this axis; None if nothing was
    pressed, or no form is curved."""
    forms = [each.tensor for each in scanned.surface.removed if any(each.curvatures)]
    if scanned.contact is None or not forms:
        return None
    both = np.diag(np.divide(1.0, along(scanned.contact.scene.sphere_radius))) + sum(forms)
    curvatures, angle = principal(both)
    if abs(angle) > 45.0:
        curvatures, angle = curvatures[::-1], angle - math.copysign(90.0, angle)
    first, second = (1.0 / each if each else math.inf for each in curvatures)
    return (first, second), angle


def _pressed_by(scanned: Scanned) -> str:
    """The radii of the pressing body, if a curved form was removed from the map; else ""."""
    if scanned.contact is None or (found := with_form(scanned)) is None:
        return ""
    radii, angle = found
    own = _radii(along(scanned.contact.scene.sphere_radius))
    said = f"{own}; {_radii(radii)} with the removed form, unless {own} contains it already"
    if abs(angle) > TURNED and _radii(radii).startswith("["):
        said += f"; the axis of the first is at {angle:.3g}° from x: "
        said += f"turn x and y of the summits by {-angle:.3g}°"
    return said


def _radii(radii: tuple[float, float]) -> str:
    first, second = (f"{each:.6g}" for each in radii)
    return first if first == second else f"[{first}, {second}]"


def _describe_curve(curve: Provability, unit: str, force: str) -> list[str]:
    columns = {
        "pruning [%]": 100 * curve.prune,
        in_unit("height", unit): curve.heights,
        **curve.columns("summits", "contacts", "undecided"),
        "proof": curve.scope,
        "crowding": curve.crowding,
        "model error": curve.model_error,
        "assumptions": np.where(curve.trusted, "met", curve.doubts),
    }
    table = [[*columns], *zip(*(each.tolist() for each in columns.values()), strict=True)]
    first = curve.trusted_from
    met = "met at no pruning" if np.isnan(first) else f"met from a pruning of {100 * first:.3g} %"
    said = [
        ("assumptions", f"{met}: statuses proved, discs apart, at least {FEW} contacts"),
        ("load", "falls with the pruning at one approach; --whole compares it with the whole map"),
    ]
    least, most = (each.reduce(curve.approaches) for each in (np.fmin, np.fmax))
    lightest, heaviest = (each.reduce(curve.loads) for each in (np.fmin, np.fmax))
    load = f"load {heaviest:.6g} {force}".rstrip() + ", "
    at = load if 0 < heaviest <= lightest * (1 + 1e-9) else ""
    at += "approach of the pressing body from height 0: "
    at += f"{least:.6g}{f' to {most:.6g}' if most > least else ''} {unit}".rstrip()
    return [*labelled([("pressed at", at)]), *aligned(table, digits=3), "", *labelled(said)]


def _describe_crowded(contact: Contact) -> list[str]:
    pairs, values = crowded(contact)
    worst = list(zip(pairs.tolist(), values, strict=True))[:MOST_LISTED]
    said = ", ".join(f"{i} and {j} ({value:.3g})" for (i, j), value in worst)
    more = f", and {len(pairs) - len(worst):,} more pairs" if len(pairs) > len(worst) else ""
    line = f"rows of summits.csv from 0 (and crowding): {said}{more}"
    return labelled([("overlapping", line)]) if worst else []


def warnings_about(scanned: Scanned) -> Iterator[str]:
    """The warnings about a surface and its contact."""
    surface, summits, contact = scanned.surface, scanned.summits, scanned.contact
    yield from surface.warnings
    said, found = surface.moments, scanned.maxima.statistics
    if (ratio := max(said.slope_ratio, 1 / (said.slope_ratio or 1e-300))) > 2:
        yield (
            f"slopes along one axis are {min(ratio, 1e6):.3g} times those along the other: the "
            "statistics from moments assume no preferred direction, and tips are ridges"
        )
    for name in ("density", "mean_curvature"):
        counted, expected = getattr(found, name), getattr(said, name)
        if abs(counted / expected - 1) > UNLIKE:
            yield (
                f"{name.replace('_', ' ')} of all maxima is {counted / expected:.2f} times that of "
                "a Gaussian surface with the same spectral moments"
            )
    if abs(level := summits.origin.level) > surface.max_height:
        mean = f"the mean height is {level:.6g} {surface.unit}".rstrip()
        yield f"{mean}: approaches are measured from height 0; --detrend plane subtracts the mean"
    if surface.filled_pixels is not None:
        near = maximum_filter(surface.filled_pixels, summits.origin.fit)[tuple(summits.pixels.T)]
        if count := np.count_nonzero(near):
            yield f"summits fitted to filled pixels, whose heights are not measured: {count:,}"
    if scanned.curve is None:
        return
    first, chosen = scanned.curve.trusted_from, summits.origin.prune
    (doubt,) = scanned.curve.doubts[scanned.curve.prune == chosen]
    if doubt:
        more = f"--prune {first:g} meets all, but pruning lowers the load"
        more = "no pruning meets all" if np.isnan(first) else more
        yield f"assumptions of the model not met at a pruning of {chosen:g}: {doubt}; {more}"
    if contact is None:
        return
    yield from contact.warnings
    width, diameter = max(surface.size), 2 * min(along(contact.scene.sphere_radius))
    if width > diameter:
        yield (
            f"the map is {width:.4g} {surface.unit} wide, and the sphere {diameter:.4g} "
            f"{surface.unit}: check the units of the map (--unit, --pixel) and of the radius"
        )
    if scanned.whole is not None:
        less = 1.0 - contact.load / scanned.whole.load
        if abs(less) > UNLIKE:
            yield (
                f"the asperities carry {abs(less):.0%} {'less' if less > 0 else 'more'} than the "
                "whole map at the same approach: the asperity model does not represent this map"
            )
    touching = contact.scene.contact_points[contact.loads > 0]
    reach = np.abs(touching).max(axis=0, initial=0.0)
    if (part := float((reach / np.array(surface.size) * 2).max())) > NEAR_EDGE:
        yield (
            f"contact reaches {part:.0%} of the way to the edge of the map: there may be more "
            "contact beyond the edge"
        )
