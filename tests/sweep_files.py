"""Sweeps that several tests compute, and what it means that two tables are the same."""

import json
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

import convexrough as cr

SMALL: dict[str, Any] = {
    "sphere": {"radius": 1.0},
    "material": {"contact_modulus": 1.0, "poisson_ratio": 0.3},
    "asperities": {
        "pattern": "hexagonal", "spacing": 0.0025, "tip_radius": 0.02, "within": 0.0102,
        "geometry": "summit",
    },
    "normal": {"load": 3e-7},
    "friction": {"coefficient": 0.5},
    "cycle": {"maximum_fraction": [0.37]},
    "sweep": {
        "seeds": 4,
        "measure": ["contact", "load", "loss"],
        "over": {"asperities.height_std": [0.0, 1e-6], "normal.load": [1e-7, 3e-7]},
    },
}  # fmt: skip


def tables(**changed: Any) -> dict[str, Any]:
    """Those of SMALL, with the keys of some of them changed; None takes a table out."""
    found = {name: {**table} for name, table in SMALL.items()}
    for name, keys in changed.items():
        if keys is None:
            del found[name]
        else:
            found[name] = {**found.get(name, {}), **keys}
    return found


def sweeping(**keys: Any) -> dict[str, Any]:
    """SMALL with this table [sweep] alone."""
    return {**tables(), "sweep": {"measure": ["contact"], **keys}}


def toml(contents: dict[str, Any]) -> str:
    """Of tables, of values and of inline tables."""
    lines = []
    for name, table in contents.items():
        lines += [f"[{name}]", *(f"{key} = {_toml(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        pairs = (f"{json.dumps(key)} = {_toml(it)}" for key, it in value.items())
        return "{" + ", ".join(pairs) + "}"
    return json.dumps(value)


def swept(contents: Any, **options: Any) -> cr.SweepTable:
    """Computed in this process."""
    with ThreadPoolExecutor(1) as here:
        return cr.sweep(contents, executor=here, **options)


def same(one: cr.SweepTable, other: cr.SweepTable) -> bool:
    """Bit for bit, nan for nan."""
    first, second = one.read(), other.read()
    return list(first) == list(second) and all(map(_equal, first.values(), second.values()))


def _equal(one: Any, other: Any) -> bool:
    if one.dtype.kind == "U":  # as wide as its longest
        return one.tolist() == other.tolist()
    return one.dtype == other.dtype and one.tobytes() == other.tobytes()


def numbers(table: cr.SweepTable, *names: str) -> list[Any]:
    columns = table.read(names)
    return [np.asarray(columns[name]).tolist() for name in names]
