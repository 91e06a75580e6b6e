"""Programs as files of other libraries: qpsolvers' .npz, Clarabel's JSON, and CBF.

CBF is written here: of the Python packages that write it, MOSEK and COPT are commercial, and that
of PICOS (2.6) fails on every problem. What is written is read back by each library in the tests.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from convexrough.arrays import Array
from convexrough.solvers.programs import ConeProgram, QuadraticProgram

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix


def qpsolvers_npz(program: QuadraticProgram) -> bytes:
    """What qpsolvers.Problem.load reads: min x'Px/2 + q'x, G x <= h, A x = b; dense, compressed.

    Rows with two equal sides are the equations; the others have a lower side alone.
    """
    upper = program.quadratic.toarray()
    rows = program.constraints.toarray()
    equal = program.lower == program.upper
    none = np.array(None)  # as Problem.save writes what is not there
    file = io.BytesIO()
    np.savez_compressed(
        file,
        P=upper + np.triu(upper, 1).T,
        q=program.linear,
        G=-rows[~equal],
        h=-program.lower[~equal],
        A=rows[equal],
        b=program.lower[equal],
        lb=none,
        ub=none,
    )
    return file.getvalue()


def clarabel_json(program: ConeProgram) -> bytes:
    """What clarabel.load_from_file reads; its Python package (0.11) has nothing that writes it."""
    data = {
        "P": _columns(program.quadratic),
        "q": program.linear.tolist(),
        "A": _columns(program.constraints),
        "b": program.constant.tolist(),
        "cones": [
            {"ZeroConeT": program.equalities},
            *[{"SecondOrderConeT": 3}] * program.cones,
        ],
    }
    return json.dumps(data).encode()


def _columns(matrix: csc_matrix) -> dict[str, Any]:
    matrix.sort_indices()
    return {
        "m": matrix.shape[0],
        "n": matrix.shape[1],
        "colptr": matrix.indptr.tolist(),
        "rowval": matrix.indices.tolist(),
        "nzval": matrix.data.tolist(),
    }


def cbf(program: ConeProgram) -> bytes:
    """The program in the Conic Benchmark Format, version 1, with a linear objective.

    x'Px/2 is a variable t of its own, the last one, with P = F'F and

        t >= |Fx|^2 / 2    as    t + 1/2 >= |(t - 1/2, Fx)|,

    so the objective is q'x + t. Constraints are cones that hold an affine function of (x, t).
    """
    width = len(program.linear)
    factor = _factor(program.quadratic)
    quadratic = len(factor) + 2
    first = len(program.constant)  # row of the cone of t
    entries = [
        *_entries(-program.constraints.tocoo()),
        (first, width, 1.0),
        (first + 1, width, 1.0),
    ]
    entries += [
        (first + 2 + i, int(j), float(factor[i, j]))
        for i in range(len(factor))
        for j in np.flatnonzero(factor[i])
    ]
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


def _factor(quadratic: csc_matrix) -> Array:
    """F with F'F = P, by eigenvalues: P may have some that are 0 but for rounding."""
    upper = quadratic.toarray()
    used = np.flatnonzero(upper.diagonal())
    small = upper[np.ix_(used, used)]
    values, vectors = np.linalg.eigh(small + np.triu(small, 1).T)
    factor = np.zeros((len(used), quadratic.shape[0]))
    factor[:, used] = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return factor


def _entries(matrix: Any) -> Iterator[tuple[int, int, float]]:
    yield from zip(matrix.row.tolist(), matrix.col.tolist(), matrix.data.tolist(), strict=True)


def _counted(entries: list[tuple[Any, ...]]) -> list[str]:
    """How many are not 0, and those, a line each; repr of each number reads back the same."""
    lines = [" ".join(map(repr, entry)) for entry in entries if entry[-1] != 0]
    return [str(len(lines)), *lines]
