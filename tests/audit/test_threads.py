"""One thread and two add up in another order: the answers agree within their bounds."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

PROGRAM = """
import sys
import numpy as np
import convexrough as cr

a = cr.Asperities.hexagonal(
    spacing=0.001, tip_radius=0.008, within=0.0102, height_std=1e-6, seed=3
)
contact = cr.press(
    cr.Scene(1.0, a, cr.Material(1.0, 0.3), 0.5), approach=5e-5, influence=sys.argv[1]
)
state = cr.shear(contact, force=0.25 * contact.load)
np.savez(
    sys.argv[2], loads=contact.loads, load_errors=contact.certificate.load_errors,
    statuses=contact.status, forces=state.forces, force_errors=state.certificate.force_errors,
    shear_statuses=state.status,
)
"""


def answer(folder: Path, influence: str, threads: int) -> Any:
    out = folder / f"{influence}{threads}.npz"
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    environment = {**os.environ, **dict.fromkeys(names, str(threads))}
    subprocess.run(
        [sys.executable, "-c", PROGRAM, influence, str(out)], env=environment, check=True
    )
    return np.load(out)


@pytest.mark.parametrize("influence", ["dense", "lattice", "scattered"])
@pytest.mark.sample(1)
def test_one_thread_and_two(tmp_path: Path, influence: str) -> None:
    one, two = (answer(tmp_path, influence, threads) for threads in (1, 2))
    for name in ("load", "force"):
        apart = np.abs(one[f"{name}s"] - two[f"{name}s"])
        assert (apart <= one[f"{name}_errors"] + two[f"{name}_errors"]).all()
    assert (one["statuses"] == two["statuses"]).all()
    assert (one["shear_statuses"] == two["shear_statuses"]).all()
