"""One thread and two add up in another order: the answers agree within their bounds."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import hexagonal
from threadpoolctl import threadpool_limits

import convexrough as cr


def answer(influence: Any, threads: int) -> tuple[cr.Contact, cr.ShearState]:
    rough = hexagonal(spacing=0.0013, tip_radius=0.0104, height_std=1e-6, seed=3)
    scene = replace(rough, friction=0.5, geometry="closest")
    with threadpool_limits(threads):
        contact = cr.press(scene, approach=5e-5, influence=influence)
        return contact, cr.shear(contact, force=0.25 * contact.load)


@pytest.mark.parametrize("influence", ["dense", "lattice", "scattered"])
@pytest.mark.sample(1)
def test_one_thread_and_two(influence: str) -> None:
    (one, slid), (two, slid_too) = (answer(influence, threads) for threads in (1, 2))
    apart = np.abs(one.loads - two.loads)
    assert (apart <= one.certificate.load_errors + two.certificate.load_errors).all()
    apart = np.abs(slid.forces - slid_too.forces)
    assert (apart <= slid.certificate.force_errors + slid_too.certificate.force_errors).all()
    assert (one.status == two.status).all()
    assert (slid.status == slid_too.status).all()
