"""The symbol of a lattice's coupling: against closed forms, pieces of lattices, sums of pairs."""

import numpy as np
import pytest
from flint import dirichlet_char
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scenes import LATTICES, lattice_operator

from convexrough.arrays import Array
from convexrough.influence.coupling import inverse_distances
from convexrough.influence.dense import DenseInfluence
from convexrough.influence.lattice import LEAST_NEGATIVE
from convexrough.influence.lattice_symbol import LOST, TOLERANCE, _Symbol, least_symbol
from convexrough.scene.lattice import Lattice, _shortest

HEXAGONAL = np.array(LATTICES["hexagonal"])
SCALE = 0.37


def closed_forms() -> tuple[float, float]:
    """Epstein's sums of 1 / r at the corner: of the hexagonal and of the square lattice."""
    characters = (1, 1), (3, 2), (4, 3)
    zeta, by_three, by_four = (dirichlet_char(*each).l(0.5).real for each in characters)
    # Every third site has the sign 1, the others -1/2: 3/2 times a lattice of 3^(1/2) the size.
    hexagonal = 3 * zeta * by_three * (np.sqrt(3) - 1)
    square = 4 * (np.sqrt(2) - 1) * zeta * by_four
    return float(hexagonal), float(square)


def bases() -> st.SearchStrategy[Array]:
    """Reduced, with a shortest vector of length 1."""

    def basis(x: float, length: float) -> Array:
        return np.array([[1.0, 0.0], [x, np.sqrt(max(length**2 - x * x, 0.0))]])

    found = st.builds(basis, st.floats(0, 0.5), st.floats(0, 2.5).map(lambda e: 10**e))
    return found.filter(lambda b: bool(np.hypot(*b[1]) >= 1))


def test_closed_forms() -> None:
    """The least is at the corner, where it is known."""
    row = -2 * np.log(2)
    lattices = HEXAGONAL, np.eye(2), np.diag([1.0, 40.0])
    for basis, exact in zip(lattices, (*closed_forms(), row), strict=True):
        assert exact - 1.01 * TOLERANCE < least_symbol(basis) < exact
    assert -row > LEAST_NEGATIVE
    assert least_symbol(np.diag([1.0, 51.0])) == -np.inf


@settings(max_examples=15, deadline=None)
@given(bases(), st.integers(0, 2**32 - 1))
def test_no_piece_of_a_lattice_has_less(basis: Array, seed: int) -> None:
    """Eigenvalues of 1 / r among any sites; the bound is not far below those of large pieces."""
    bound = least_symbol(basis)
    if bound == -np.inf:
        return
    rng = np.random.default_rng(seed)
    across = max(1, round(24 / np.hypot(*basis[1])))
    sites = np.stack(np.divmod(np.arange(400), across), axis=1) @ basis
    for taken in (np.arange(400), rng.choice(400, 120, replace=False), np.arange(7)):
        points = sites[taken]
        assert np.linalg.eigvalsh(inverse_distances(points, points))[0] > bound
    assert np.linalg.eigvalsh(inverse_distances(sites, sites))[0] < bound + 0.06


@settings(max_examples=40, deadline=None)
@given(bases(), st.integers(0, 2**32 - 1))
def test_bounds_hold_in_all_of_a_cell(basis: Array, seed: int) -> None:
    rng = np.random.default_rng(seed)
    symbol = _Symbol.of(basis)
    cells, size = rng.uniform(-0.5, 0.5, (20, 2)), 10 ** rng.uniform(-3, -0.5)
    values, bounds = symbol.over(cells, size)
    assert (bounds <= values).all()
    corners = rng.choice([-0.5, 0.5], (20, 2))
    for away in (corners, rng.uniform(-0.5, 0.5, (20, 2))):
        elsewhere = symbol.over(cells + size * away, size)[0]
        assert (bounds <= elsewhere + LOST).all()


@pytest.mark.parametrize("basis", [HEXAGONAL, np.eye(2), np.array([[1.0, 0.0], [0.3, 1.7]])])
def test_the_symbol_is_that_of_the_sum(basis: Array) -> None:
    """sum v_i v_j / r_ij over pairs is the mean of f |v|^2 over waves."""
    rng = np.random.default_rng(1)
    sites = np.stack(np.divmod(rng.choice(25, 9, replace=False), 5), axis=1)
    v = rng.normal(size=9)
    v -= v.mean()  # where f is infinite it then counts for nothing
    points = sites @ basis
    exact = float(v @ inverse_distances(points, points) @ v)
    symbol = _Symbol.of(basis)
    off = []
    for count in (40, 80):
        cells = (np.indices((count, count)).reshape(2, -1).T + 0.5) / count - 0.5
        waves = np.exp(2j * np.pi * cells @ sites.T) @ v
        off.append(abs((symbol.over(cells, 0.0)[0] * np.abs(waves) ** 2).mean() - exact))
    assert off[1] < 1e-4 * float(v @ v)
    assert off[1] < 0.2 * off[0]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(1.3, 1.7), st.floats(0, 0.02))
def test_points_off_their_sites_are_counted(seed: int, share: float, off: float) -> None:
    """Whatever is said to be semidefinite is so, though no shells of that radius are apart."""
    rng = np.random.default_rng(seed)
    basis = _shortest(np.stack(np.divmod(np.arange(25.0), 5), axis=1) @ rng.normal(size=(2, 2)))
    assume(basis is not None)  # there is none of points nearly on a line
    lattice = Lattice(np.zeros(2), basis, 1e-13 + off * float(np.hypot(*basis[0])))
    sites = np.stack(np.divmod(np.arange(100), 10), axis=1) @ basis
    points = sites + rng.uniform(-off, off, sites.shape) * lattice.spacing * (1 - 1e-9)
    A = lattice_operator(points, SCALE, lattice)
    radius = lattice.spacing / share
    if not A.semidefinite_with(radius):
        return
    matrix = DenseInfluence.assemble(points, SCALE).matrix
    assert np.linalg.eigvalsh(matrix + SCALE / radius * np.eye(100))[0] >= 0
