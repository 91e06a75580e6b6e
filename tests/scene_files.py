"""Scene files, files of loads and sweeps that several tests write, and tables that they read."""

import csv
import gzip
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

import convexrough as cr
from convexrough.verdict.claims import Claimed, Manner, read_forces

Columns = Mapping[str, Iterable[Any]]

HEXAGONAL = """
pattern = "hexagonal"
spacing = 0.0025
tip_radius = 0.02
geometry = "summit"
"""
WITHIN = f"{HEXAGONAL}within = 0.0102\n"
FRICTION = "[friction]\ncoefficient = 0.5\n"
ONE_BODY = "contact_modulus = 1.0\npoisson_ratio = 0.3"
TWO_BODIES = """[material.sphere]
youngs_modulus = 210e3
poisson_ratio = 0.3
hardness = 8e3
[material.base]
youngs_modulus = 70e3
poisson_ratio = 0.33"""

#: Some tables, which take no time.
STAGES = """
[shear]
fractions = [0.25, 0.5]
[cycle]
maximum_fraction = [0.3]
loop_points = 40
[history]
fractions = [0.3, -0.3, 0.1]
"""

#: Every table that a scene file may have, for the paper's scene, of this load.
LOAD = 3.6085338874666633e-07
EVERYTHING = f"""{FRICTION}
[shear]
fractions = [0.1, 0.37, 0.5]
[cycle]
maximum_fraction = [0.37, 0.5]
minimum_fraction = [-0.37, 0.1]
[history]
fractions = [0.6, -0.2, 0.3, -0.6, 0.6]
[path]
loads = [0.6, 0.6, 1.0, 1.0]
forces = [0.0, 0.15, 0.15, -0.075]
reference = {LOAD}
[steady]
ellipse = {{ load = 0.7, load_amplitude = 0.28, force_amplitude = 0.175, chords = 12 }}
reference = {LOAD}
phases = [0.5]
[shakedown]
load = {LOAD}
force_amplitudes = [1.8042669437333e-07, -1.8042669437333e-07]
[gradient]
of = "loss"
fraction = 0.5
"""


def scene_text(
    asperities: str = HEXAGONAL,
    normal: str = "approach = 5e-5",
    more: str = "",
    radius: str = "1.0",
    material: str = ONE_BODY,
) -> str:
    return f"""
[sphere]
radius = {radius}
[material]
{material}
[asperities]
{asperities}
[normal]
{normal}
{more}
"""


def rows(path: Path | str) -> list[dict[str, str]]:
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def cells(columns: Columns) -> list[list[Any]]:
    """Rows of a table, the first of names."""
    below = zip(*(np.asarray(each).tolist() for each in columns.values()), strict=True)
    return [list(columns), *map(list, below)]


def lines(columns: Columns, separator: str = ",", decimal: str = ".", header: bool = True) -> str:
    """A table of text, as any program writes it."""
    names, *below = cells(columns)
    written = [[str(cell).replace(".", decimal) for cell in row] for row in below]
    return "".join(separator.join(row) + "\n" for row in [*([names] if header else []), *written])


def refusal(read: Callable[[Path], Any], path: Path) -> list[str]:
    """The lines of the message with which a file is refused, each without the path."""
    with pytest.raises(cr.ConvexroughError) as caught:
        read(path)
    said = str(caught.value).split("\n")
    assert all(line.startswith(f"{path}: ") for line in said)
    return [line.removeprefix(f"{path}: ") for line in said]


def put(folder: Path, made: Any, name: str = "loads.csv") -> str:
    """Write columns, an array, sheets of rows, text, or bytes, as the name of the file says."""
    path, kind = folder / name, name.rpartition(".")[2]
    if isinstance(made, bytes):
        path.write_bytes(made)
    elif kind == "npy":
        np.save(path, made)
    elif kind == "npz":
        np.savez(path, **made)
    elif kind == "mat":
        savemat(path, made)
    elif kind == "xlsx":
        book = pytest.importorskip("openpyxl").Workbook()
        book.remove(book.active)
        for sheet in made:
            page = book.create_sheet()
            for row in sheet:
                page.append(row)
        book.save(path)
    elif kind == "parquet":
        arrow, parquet = map(pytest.importorskip, ("pyarrow", "pyarrow.parquet"))
        parquet.write_table(arrow.table(made), path)
    else:
        content = (made if isinstance(made, str) else lines(made)).encode()
        path.write_bytes(gzip.compress(content) if kind == "gz" else content)
    return name


def claimed(
    folder: Path, made: Any, name: str = "loads.csv", *, scene: cr.Scene, **how: Any
) -> Claimed:
    """The loads of a file that holds this."""
    return read_forces(folder / put(folder, made, name), scene, Manner(**how))


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
    return {
        name: SMALL.get(name, {}) | changed.get(name, {})
        for name in SMALL | changed
        if changed.get(name, {}) is not None
    }


def sweeping(**keys: Any) -> dict[str, Any]:
    """SMALL with this table [sweep] alone."""
    return {**tables(), "sweep": {"measure": ["contact"], **keys}}


def toml(contents: dict[str, Any]) -> str:
    """A file of inline tables."""
    return "".join(f"{name} = {_toml(table)}\n" for name, table in contents.items())


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        pairs = (f"{json.dumps(key)} = {_toml(it)}" for key, it in value.items())
        return "{" + ", ".join(pairs) + "}"
    return json.dumps(value)


#: The command. An interrupt is an interrupt, whatever started the tests; the output says from when.
INTERRUPTIBLE = """
import signal, sys
from convexrough.__main__ import main
signal.signal(signal.SIGINT, signal.default_int_handler)
print("started", flush=True)
sys.exit(main())
"""


def scripted(folder: Path, script: str, *arguments: str) -> subprocess.Popen[str]:
    """A script, which needs no guard although its workers are new interpreters."""
    (folder / "script.py").write_text(script)
    return subprocess.Popen(
        [sys.executable, "script.py", *arguments], cwd=folder, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, start_new_session=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip


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
    return [column.tolist() for column in table.read(names).values()]
