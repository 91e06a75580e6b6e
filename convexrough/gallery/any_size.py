"""Contacts of any size with a known answer, whose heights follow from chosen loads and gaps."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.gallery.cases import FRICTION, MATERIAL
from convexrough.influence.choice import couple
from convexrough.record import Record
from convexrough.scene.asperities import Asperities, checked_seed
from convexrough.scene.scene import Scene


@dataclass(frozen=True, eq=False, repr=False)
class Manufactured(Record):
    """A contact made by `manufactured`, whose answer is known up to the rounding of its heights.

    `cr.certify(made.scene, made.loads, approach=made.approach)` bounds the effect of this rounding
    and proves the statuses.

    approach : [length] the prescribed approach
    loads    : (n,) [force] 0 where open;  gaps : (n,) [length] 0 where touching
    """

    scene: Scene
    approach: float
    loads: Array
    gaps: Array


def manufactured(count: int, *, seed: int = 0, touching: float = 0.7) -> Manufactured:
    """A contact of `count` asperities on a hexagonal lattice, with a known answer.

    Each asperity touches with the probability `touching`. Contact radii are random from 0.1 to 0.45
    spacings, tip radii from 4 to 8 spacings, and gaps from 0 to the largest indentation. With other
    versions of numpy, a `seed` may give other numbers. Raises InputError for a `count` below 1, or
    if `touching` is not from 0 to 1.

    >>> made = cr.gallery.manufactured(500)
    >>> proof = cr.certify(made.scene, made.loads, approach=made.approach)
    >>> proof.all_proved, bool(proof.load_errors.max() < 1e-9 * made.loads.max())
    (True, True)
    """
    checks.whole("count", count)
    part = checks.between("touching", touching, 0.0, 1.0)
    random = np.random.default_rng(checked_seed(seed))
    patch = Asperities.hexagonal(spacing=1.0, tip_radius=1.0, within=0.6 * np.sqrt(count) + 1)
    tips = random.uniform(4.0, 8.0, count)
    flat = Asperities(patch.positions[:count], tips)
    scene = Scene(1e3 * np.sqrt(count), flat, MATERIAL, FRICTION, geometry="summit")

    touches = random.random(count) < part
    radii = np.where(touches, random.uniform(0.1, 0.45, count), 0.0)
    own = radii**2 / scene.relative_radii
    gaps = np.where(touches, 0.0, random.uniform(0.0, own.max(initial=0.0) or 1.0, count))
    loads = 4.0 / 3.0 * MATERIAL.contact_modulus * radii * own
    coupling = couple(scene, np.arange(count), 1.0 / (np.pi * MATERIAL.contact_modulus), None)
    heights = own + coupling.apply(loads) - gaps - scene.offsets
    approach = float(heights.max())
    tall = replace(scene, asperities=Asperities(flat.positions, tips, heights - approach))
    return Manufactured(tall, approach, frozen(loads), frozen(gaps))
