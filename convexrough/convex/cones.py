"""Powers of a number between 0 and 1, represented by second-order cones.

A *lift* of t in [0, 1] is a set of variables y2, y3, y4, y5 for t^2, ..., t^5 and z for t^5 - t^6;
the form with five cones also has y1 for t. docs/theory/exact-cones.md, "The lifted program", gives
the four cones (1) and the five cones (2), and proves up to which convexity number S of a box each
form is exact: 21/25 with four cones, 1 with five.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from convexrough.arrays import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

#: The largest S for which four cones are exact, and the largest S for which five cones are exact.
FOUR_CONES_LIMIT, FIVE_CONES_LIMIT = 21 / 25, 1.0

# Each cone x y >= w^2 is given by rows for x, y and w, in the columns 1, y1, y2, y3, y4, y5, z.
_Y1_AND_Y3 = [[1, -1, 0, 0, 0, 0, 0], [0, 0, 1, -1, 0, 0, 0], [0, 1, -1, 0, 0, 0, 0]]
_Y2_AND_Y4 = [[0, 1, -1, 0, 0, 0, 0], [0, 0, 0, 1, -1, 0, 0], [0, 0, 1, -1, 0, 0, 0]]
_SQUARE = [[1, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 1, 0, 0], [0, 0, 1, 0, 0, 0, 0]]
_Y3_AND_Y5 = [[0, 0, 1, -1, 0, 0, 0], [0, 0, 0, 0, 1, -1, 0], [0, 0, 0, 1, -1, 0, 0]]
_PRODUCT = [[0, 0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 1, 0, 0]]
_WITH_Z = [[0, 0, 0, 1, -1, 0, 0], [0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 1, -1, 0]]

#: (cones, 3, 7): for each cone, rows for x, y and w, in the columns 1, y1, ..., y5, z.
FOUR_CONES = np.array([_SQUARE, _Y3_AND_Y5, _PRODUCT, _WITH_Z], dtype=np.float64)
FIVE_CONES = np.array([_Y1_AND_Y3, _Y2_AND_Y4, _Y3_AND_Y5, _PRODUCT, _WITH_Z], dtype=np.float64)

#: x y >= w^2 with x, y >= 0 is the second-order cone  x + y >= || (x - y, 2 w) ||.
SECOND_ORDER = np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 2.0]])


def power_cones(n: int, *, five: bool) -> tuple[csr_array, Array]:
    """Rows with  constant - matrix @ variables  in second-order cones of dimension 3, for n lifts.

    Rows are grouped by lift. The variables are y2, y3, y4, y5 and z, (n,) each; for the form with
    five cones y1, ..., y5 and z.
    """
    from scipy import sparse  # 0.1 s to import: only when solving

    rows = (SECOND_ORDER @ (FIVE_CONES if five else FOUR_CONES)).reshape(-1, 7)  # of one lift
    constant, coefficients = rows[:, 0], rows[:, 1 if five else 2 :]
    by_row = sparse.csr_array(sparse.kron(-coefficients, sparse.eye_array(n)))
    by_lift = np.arange(len(rows) * n).reshape(len(rows), n).T.ravel()
    return by_row[by_lift], np.tile(constant, n)
