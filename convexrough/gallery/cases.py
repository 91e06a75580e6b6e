"""Hard cases, and contacts of any size made from chosen loads and gaps: scenes with answers."""

from __future__ import annotations

import json
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, cached_property
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.errors import InputError
from convexrough.influence.choice import couple
from convexrough.record import Record
from convexrough.scene.asperities import Asperities, checked_seed
from convexrough.scene.material import Material
from convexrough.scene.scene import Scene

#: The file of scenes and answers, a line for each case, which `tests/gallery_answers.py` writes.
DATA = "cases.json"

#: Friction and material of all cases; only cases in other units have another contact modulus.
FRICTION = 0.5
MATERIAL = Material(contact_modulus=1.0, poisson_ratio=0.3)

#: Number of shear forces in a history before the last one.
REVERSALS = 100_000


@dataclass(frozen=True, eq=False, repr=False)
class Checked(Record):
    """Comparison of loads or forces with the answer: `HardCase.check` and `check_shear`.

    wrongly_open   : (m,) indices of asperities that touch and have no given load (or shear force)
    wrongly_loaded : (m,) indices of asperities that are open and have a given load (or force)
    error          : largest error, over the largest load or force of the answer
    within         : the largest error allowed
    """

    wrongly_open: Indices
    wrongly_loaded: Indices
    error: float
    within: float

    @property
    def right(self) -> bool:
        """True if the set of loaded asperities is correct and `error` is at most `within`."""
        wrong = len(self.wrongly_open) + len(self.wrongly_loaded)
        return wrong == 0 and self.error <= self.within

    def __bool__(self) -> bool:
        """True if the loads or forces are `right`."""
        return self.right


@dataclass(frozen=True, eq=False, repr=False)
class HardCase(Record):
    """A hard scene, with an answer that is known to 50 digits.

    Digits are strings. "0" is exact; the error of other numbers is at most one unit of the 50th
    digit. The answer is that of the scene whose data are the given float64 numbers. An interval
    Newton step proves that a solution agrees with these digits and is the only one nearby;
    `cr.certify` shows whether it is the only one anywhere.

    family, why : name of the group of similar cases, and a sentence on the difficulty
    approach [length], load [force] : one of them is prescribed; the other is None
    loads, gaps : (n,) digits [force], [length]
    exact_approach, exact_load : digits [length], [force]
    shear_force : [force] the shear force at the end
    history     : (m,) [force] shear forces up to `shear_force`; empty if it is applied from rest
    forces, slips : (n,) digits [force], [length] under `shear_force`; empty if an asperity loses
        load as the total load rises, because the theorem of Ciavarella and Jaeger does not apply
    displacement  : digits [length] of the relative displacement of the bodies, or ""

    >>> case = cr.gallery.case("grazing-gap-1e-9")
    >>> contact = cr.press(case.scene, **case.control)
    >>> case.check(contact.loads).right, int(case.touching.sum())
    (True, 7)
    >>> state = cr.shear(contact, force=case.shear_force)
    >>> case.check_shear(state.forces, within=1e-12).right
    True
    """

    name: str
    family: str
    why: str
    scene: Scene
    approach: float | None
    load: float | None
    loads: tuple[str, ...]
    gaps: tuple[str, ...]
    exact_approach: str
    exact_load: str
    shear_force: float
    history: Array
    forces: tuple[str, ...]
    slips: tuple[str, ...]
    displacement: str

    def __len__(self) -> int:
        return len(self.loads)

    @property
    def control(self) -> dict[str, Any]:
        """The approach or the load, as an argument of `cr.press`, `cr.certify` and `cr.verify`."""
        return {"approach": self.approach} if self.load is None else {"load": self.load}

    @cached_property
    def touching(self) -> NDArray[np.bool_]:
        """(n,) True for the asperities that touch."""
        return frozen(np.array([digits != "0" for digits in self.loads]))

    def check(self, loads: ArrayLike, *, within: float = 1e-6, floor: float = 0.0) -> Checked:
        """The comparison of loads (n,) [force] with the answer.

        within : largest error allowed, over the largest load
        floor  : [force] an asperity with a load up to this counts as open

        Raises InputError for a wrong number of loads.
        """
        given = checks.array("loads", loads, length=len(self))
        claimed = given > checks.non_negative("floor", floor)
        return self._judged(given, self.loads, claimed, within)

    def check_shear(self, forces: ArrayLike, *, within: float = 1e-6) -> Checked:
        """The comparison of shear forces (n,) [force], at the end of `history`, with the answer.

        within : largest error allowed, over the largest shear force

        Raises InputError for a wrong number of forces, and if there is no answer in shear.
        """
        if not self.forces:
            found = "a case in which an asperity loses load as the total load rises"
            raise InputError("forces", found=found, expected="a case with an answer in shear")
        given = checks.array("forces", forces, length=len(self))
        return self._judged(given, self.forces, given != 0, within)

    def _judged(
        self, given: Array, digits: Sequence[str], claimed: NDArray[np.bool_], within: float
    ) -> Checked:
        """The comparison, in exact arithmetic, because some errors are below float64's rounding."""
        exact = [Fraction(each) for each in digits]
        apart = max(abs(Fraction(float(a)) - b) for a, b in zip(given, exact, strict=True))
        largest = max(map(abs, exact))
        return Checked(
            wrongly_open=frozen(np.flatnonzero(self.touching & ~claimed)),
            wrongly_loaded=frozen(np.flatnonzero(claimed & ~self.touching)),
            error=float(apart / largest) if largest else float(apart),
            within=checks.positive("within", within),
        )


def names(*wanted: str) -> tuple[str, ...]:
    """The names of all cases, or of the cases and families in `wanted`.

    Raises InputError for an unknown name; the message suggests the most similar one.

    >>> cr.gallery.names("few", "clustered")
    ('one', 'one-under-load', 'two-equal', 'clustered')
    """
    families = {name: data["family"] for name, data in stored().items()}
    for each in wanted:
        if each not in families and each not in families.values():
            valid = [*families, *sorted(set(families.values()))]
            expected = f"the name of a case or a family; {checks.nearest(str(each), valid)}"
            raise InputError("names", found=repr(each), expected=expected)
    return tuple(
        name for name in families if not wanted or name in wanted or families[name] in wanted
    )


def case(name: str) -> HardCase:
    """The hard case of this name. Raises InputError if there is none.

    >>> cr.gallery.case("one").why
    'one contact: no neighbours, no shells, an answer in closed form'
    """
    if name not in stored():
        expected = f"the name of a case; {checks.nearest(str(name), stored())}"
        raise InputError("name", found=repr(name), expected=expected)
    data = stored()[name]
    answer, turns = data["answer"], np.array(_reversals(data["reversals"]))
    known: dict[str, Any] = {each: data[each] for each in ("family", "why", "shear_force")}
    known |= {each: data["prescribed"].get(each) for each in ("approach", "load")}
    known |= {f"exact_{each}": answer[each] for each in ("approach", "load")}
    known |= {each: tuple(answer[each]) for each in ("loads", "gaps", "forces", "slips")}
    known |= {"displacement": answer["displacement"]}
    return HardCase(
        name, scene=scene_of(data), history=frozen(turns * data["shear_force"]), **known
    )


def scene_of(data: Mapping[str, Any]) -> Scene:
    """The scene of an entry of the file `DATA`."""
    asperities = Asperities(data["positions"], data["tip_radii"], data["heights"])
    material = Material(data["contact_modulus"], data["poisson_ratio"])
    return Scene(data["sphere_radius"], asperities, material, data["friction"], data["geometry"])


@cache
def stored() -> dict[str, Any]:
    """The scenes and answers of the file `DATA`, by name."""
    text = files("convexrough.gallery").joinpath(DATA).read_text(encoding="utf-8")
    return dict(json.loads(text))


def _reversals(kind: str) -> list[float]:
    """Shear forces, divided by the last and largest one; ranges of "nested" forces decrease."""
    if kind == "nested":
        turns = [(-0.9 if k % 2 else 0.9) * (1 - k / REVERSALS) for k in range(REVERSALS)]
        return [*turns, 1.0]
    if kind == "random":
        numbers, turns = random.Random(8), [0.0]
        for k in range(1, REVERSALS):
            value = turns[-1] if k % 10 == 0 else 1.8 * numbers.random() - 0.9
            turns.append(0.0 if k % 7 == 0 else value)
        return [*turns, 1.0]
    return []


@dataclass(frozen=True, eq=False, repr=False)
class Manufactured(Record):
    """A contact made by `manufactured`, whose answer is known up to the rounding of its heights.

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
    versions of numpy, a `seed` may give other numbers. `cr.certify` bounds the effect of rounding.
    Raises InputError for a `count` below 1, or if `touching` is not from 0 to 1.

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
