"""File formats of other libraries: qpsolvers' .npz, Clarabel's JSON, CBF and MPS."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from convexrough import checks
from convexrough.solvers.programs import ConeProgram, QuadraticProgram

if TYPE_CHECKING:
    from scipy.sparse import csc_array


def qpsolvers_npz(program: QuadraticProgram) -> bytes:
    """The contents of a file for qpsolvers.Problem.load, with dense matrices.

    qpsolvers' problem is: minimise x'Px/2 + q'x subject to G x <= h and A x = b. Rows of `program`
    with two equal bounds become equations; other rows must have no upper bound.
    """
    width, height = len(program.linear), len(program.lower)
    checks.fits_in_memory("asperities", 1, 24.0 * width * (width + height))
    upper, rows = program.quadratic.toarray(), program.constraints.toarray()
    equal, none = program.lower == program.upper, np.array(None)  # as Problem.save writes it
    return _npz(
        P=upper + np.triu(upper, 1).T,
        q=program.linear,
        G=-rows[~equal],
        h=-program.lower[~equal],
        A=rows[equal],
        b=program.lower[equal],
        lb=none,
        ub=none,
    )


def _npz(**arrays: Any) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def clarabel_json(program: ConeProgram) -> bytes:
    """The contents of a file for clarabel.load_from_file."""
    data = {
        "P": _columns(program.quadratic),
        "q": program.linear.tolist(),
        "A": _columns(program.constraints),
        "b": program.constant.tolist(),
        "cones": [{"ZeroConeT": program.equalities}, *[{"SecondOrderConeT": 3}] * program.cones],
    }
    return json.dumps(data).encode()


def _columns(matrix: csc_array) -> dict[str, Any]:
    matrix.sort_indices()
    return {
        "m": matrix.shape[0],
        "n": matrix.shape[1],
        "colptr": matrix.indptr.tolist(),
        "rowval": matrix.indices.tolist(),
        "nzval": matrix.data.tolist(),
    }


def cone_npz(program: ConeProgram) -> bytes:
    """The contents of an .npz file with the arrays of a cone program.

    P_data, P_indices and P_indptr are the arguments of scipy's `csc_array` for the whole symmetric
    matrix P; A_data, A_indices and A_indptr those for A. q, b and `equalities` are as in
    `ConeProgram`.
    """
    from scipy import sparse  # takes 0.1 s to import

    upper = program.quadratic
    whole = sparse.csc_array(upper + sparse.triu(upper, 1).T)
    parts = {
        f"{name}_{part}": getattr(matrix, part)
        for name, matrix in (("P", whole), ("A", program.constraints))
        for part in ("data", "indices", "indptr")
    }
    return _npz(**parts, q=program.linear, b=program.constant, equalities=program.equalities)


def mps(program: QuadraticProgram) -> bytes:
    """The contents of a file in free MPS with a section QUADOBJ, for HiGHS, Gurobi and CPLEX.

    Rows of `program` with two equal bounds become equations; other rows must have no upper bound.
    Variables are free.
    """
    equal = program.lower == program.upper
    quadratic, constraints = program.quadratic.tocoo(), program.constraints.tocsc()
    lines = ["NAME contact", "ROWS", " N energy"]
    lines += [f" {'E' if each else 'G'} r{i}" for i, each in enumerate(equal)]
    lines.append("COLUMNS")
    for j, cost in enumerate(program.linear.tolist()):
        lines.append(f" x{j} energy {cost!r}")
        where = slice(*constraints.indptr[j : j + 2])
        entries = zip(constraints.indices[where], constraints.data[where].tolist(), strict=True)
        lines += [f" x{j} r{i} {entry!r}" for i, entry in entries]
    lines.append("RHS")
    lines += [f" rhs r{i} {side!r}" for i, side in enumerate(program.lower.tolist()) if side]
    lines.append("BOUNDS")
    lines += [f" FR bounds x{j}" for j in range(len(program.linear))]
    lines.append("QUADOBJ")
    lines += [f" x{i} x{j} {entry!r}" for i, j, entry in _entries(quadratic)]
    return "\n".join([*lines, "ENDATA", ""]).encode()


def cbf(program: ConeProgram) -> bytes:
    """The contents of a file in the Conic Benchmark Format, version 1.

    The objective of this format is linear. So one more variable t, the last, replaces x'Px/2. With
    P = F'F, the condition t >= |Fx|^2 / 2 is written as the cone

        t + 1/2 >= |(t - 1/2, Fx)|,

    and the objective is q'x + t. Constraints are affine functions of (x, t) in cones.
    """
    width, first = len(program.linear), len(program.constant)  # `first`: row of the cone of t
    upper = program.quadratic.toarray()
    used = np.flatnonzero(upper.diagonal())
    small = upper[np.ix_(used, used)]
    # F from eigenvalues: Cholesky's method fails if some of them are 0.
    values, vectors = np.linalg.eigh(small + np.triu(small, 1).T)
    factor = np.zeros((len(used), width))
    factor[:, used] = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    quadratic = len(factor) + 2
    entries = [*_entries(-program.constraints.tocoo()), (first, width, 1.0)]
    entries.append((first + 1, width, 1.0))
    i, j = np.nonzero(factor)
    entries += zip((first + 2 + i).tolist(), j.tolist(), factor[i, j].tolist(), strict=True)
    constant = [*program.constant.tolist(), 0.5, -0.5]
    cones = [("L=", program.equalities), *[("Q", 3)] * program.cones, ("Q", quadratic)]
    costs = [*enumerate(program.linear.tolist()), (width, 1.0)]
    blocks = [
        ["VER", "1"],
        ["OBJSENSE", "MIN"],
        ["VAR", f"{width + 1} 1", f"F {width + 1}"],
        ["CON", f"{first + quadratic} {len(cones)}", *(f"{cone} {size}" for cone, size in cones)],
        ["OBJACOORD", *_counted(costs)],
        ["ACOORD", *_counted(entries)],
        ["BCOORD", *_counted(list(enumerate(constant)))],
    ]
    return "\n\n".join("\n".join(block) for block in blocks).encode() + b"\n"


def sizes(ending: str, content: bytes) -> dict[str, int]:
    """The sizes that a file in CBF states; {} for formats with the sizes of the program."""
    if ending != "cbf":
        return {}
    words, marks = content.split(), {"variables": "VAR", "constraints": "CON", "nonzeros": "ACOORD"}
    return {name: int(words[words.index(mark.encode()) + 1]) for name, mark in marks.items()}


def _entries(matrix: Any) -> Iterator[tuple[int, int, float]]:
    yield from zip(matrix.row.tolist(), matrix.col.tolist(), matrix.data.tolist(), strict=True)


def _counted(entries: list[tuple[Any, ...]]) -> list[str]:
    """The number of entries whose last item is not 0, then a line for each of these entries."""
    lines = [" ".join(map(repr, entry)) for entry in entries if entry[-1] != 0]
    return [str(len(lines)), *lines]
