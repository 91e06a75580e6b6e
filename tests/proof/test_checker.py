"""Honest proofs, true by the 50-digit reference; the checker; forged proof files.

Whatever the checker accepts is true by the reference.
"""

import ast
import json
import os
import random
import re
import subprocess
import sys
from collections import Counter
from copy import deepcopy
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scenes
from flint import arb, ctx
from friction_scenes import ring, shaded
from multiprecision import coupling, exact, false_claims, quotient

import convexrough as cr
from convexrough import checker
from convexrough.checker import Interval, Refused
from convexrough.proof import prove

SOURCE = Path(checker.__file__)


def test_no_number_of_its_source_is_a_float() -> None:
    """That it imports the standard library only, the next test shows."""
    for node in ast.walk(ast.parse(SOURCE.read_text("utf-8"))):
        assert not isinstance(node, ast.Constant) or not isinstance(node.value, float)


@pytest.fixture(scope="module")
def document() -> Any:
    return proof_of(*scenes.NAMED["paper"])


@pytest.fixture(scope="module")
def few() -> Any:
    """Of six asperities, of which the last is open: it is checked many times."""
    return proof_of(*scenes.scattered(1, 6, 0.7, 0.3))


def said(program: Path, path: Path, *options: str) -> tuple[int, str, str]:
    """Status and what the checker says of a file, in a process of its own."""
    command = [sys.executable, *options, str(program), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


def test_it_runs_alone(document: Any, tmp_path: Path) -> None:
    """Without site packages, without environment: as on a stranger's machine."""
    path, copy = tmp_path / "proof.json", tmp_path / "checker.py"
    copy.write_bytes(SOURCE.read_bytes())

    def alone(contents: str) -> tuple[int, str, str]:
        path.write_text(contents)
        return said(copy, path, "-I", "-S")

    status, out, err = alone(json.dumps(document))
    assert (status, err) == (0, "")
    assert out.startswith("proved: under the approach 5e-05 there is a solution, the only one")
    assert "37 contact, 24 open, 0 undecided" in out
    assert out.count("\n") == 3 + len(document["sheared"])
    # Where it is, beside folders that could hide modules of Python; the path is no proof.
    status, _, err = said(SOURCE, tmp_path)
    assert (status, err[:12]) == (2, "unreadable: ")

    wrong = deepcopy(document)
    wrong["claims"]["status"][60] = "contact"
    refusal = "refused: claims status [60]: claimed 'contact', proved 'open'\n"
    assert alone(json.dumps(wrong)) == (1, "", refusal)
    none = tmp_path / "none.json"
    missing = f"unreadable: {none}: No such file or directory\n"
    assert said(copy, none, "-I", "-S") == (2, "", missing)


@pytest.mark.parametrize(
    ("touching", "said"), [(1, r"known to \de\+30\d of"), (6, "without a bound relative to")]
)
def test_wide_bounds_are_relative_to_a_proved_load(few: Any, touching: int, said: str) -> None:
    weak = deepcopy(few)
    weak["claims"]["loads"][:touching] = [["0x0.0p+0", (1e300).hex()]] * touching
    assert re.search(said, checker.check(weak))


@pytest.mark.parametrize(
    ("contents", "reason"),
    [
        (b"", "not JSON: Expecting value"),
        (b"\xff\xfe", "not JSON: 'utf-8' codec"),
        (b"[" * 100_000, "nested too deeply"),
        (b"[]", "expected a table"),
        (b'{"format": 1}', "the number 1: numbers are strings"),
        (b'{"format": NaN}', "the number NaN"),
        (b'{"format": "", "format": ""}', "a key appears twice"),
        (b"{}", "found none of them"),
        (b'{"format": ""}', "expected a table of format, scene"),
        (b" " * (checker.MOST_BYTES + 1), "more than"),
    ],
)
def test_unreadable(contents: bytes, reason: str, tmp_path: Path, capsys: Any) -> None:
    """Nor are two files read."""
    path = tmp_path / "proof.json"
    path.write_bytes(contents)
    for files, said in (([str(path)], reason), (["a", "b"], "usage")):
        assert checker.main(files) == 2
        assert said in capsys.readouterr().err


def copied(proof: Any) -> Any:
    return json.loads(json.dumps(proof.document))


def proof_of(scene: cr.Scene, approach: float) -> Any:
    return copied(cr.press(scene, approach=approach).proof())


def scaled(values: list[str], factor: float) -> list[str]:
    return [(factor * float.fromhex(text)).hex() for text in values]


Place = tuple[Any, ...]


def look(tree: Any, path: Place) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def put(tree: Any, path: Place, value: Any) -> None:
    look(tree, path[:-1])[path[-1]] = value


def wrong(
    document: Any, reason: str, error: type[Exception] = Refused, sha256: str = "", **changes: Any
) -> None:
    """That the checker refuses a proof, changed at the keys named a__b__c, for this reason."""
    document = deepcopy(document)
    for keys, value in changes.items():
        path = tuple(int(key) if key.isdigit() else key for key in keys.split("__"))
        put(document, path, value)
    if sha256:
        document["sha256"] = checker.digest(document["scene"], document["prescribed"])
    with pytest.raises(error, match=reason):
        checker.check(document)


def test_scenes_that_are_too_large_impossible_or_of_another_hash_are_refused(document: Any) -> None:
    wrong(document, "sha256", scene__heights__0=(1e-30).hex())
    names, many = ("x", "y", "heights", "tip_radii"), checker.MOST_ASPERITIES + 1
    columns = {f"scene__{name}": [document["scene"][name][0]] * many for name in names}
    wrong(document, "3001 asperities", sha256="fits", **columns)
    negative = (-1.0).hex()
    wrong(document, "is not positive", sha256="fits", scene__sphere_radius=negative)
    wrong(document, "is not positive", sha256="fits", scene__sphere_radius=["inf", negative])
    for radius in (["inf"], ["inf", "0x1.8p+0"], [["inf", "inf"]], "nan", "-inf"):
        wrong(document, "radius", checker.Unreadable, sha256="fits", scene__sphere_radius=radius)


def test_boxes_and_shells_that_prove_nothing_are_refused(document: Any) -> None:
    argument, radii = document["argument"], document["pressed"]["radii"]
    wrong(document, "outside the box", argument__box__0=radii[0][0])
    wrong(document, "outside the box", argument__box__0=(0.0).hex())
    wrong(document, "is too small, or", argument__shells=scaled(argument["shells"], 0.9))
    wrong(document, "overlaps others too much", argument__shells=scaled(argument["shells"], 3.0))
    wrong(document, "not positive", argument__shells__0=(0.0).hex())
    wrong(document, "convexity number", argument__convexity_number=(1.0).hex())
    wide = {"argument__box": scaled(argument["box"], 4.0), "argument__shells": None}
    wrong(document, "breaks down", **wide, argument__convexity_number=(0.999).hex())
    wrong(document, "not the one prescribed", pressed__approach=[(5.0001e-5).hex()])


def test_what_could_touch_may_be_held_open_where_it_is_proved_to_be() -> None:
    scene, approach = scenes.scattered(1, 6, 0.7, 0.3)
    document = proof_of(scene, approach)
    assert document["claims"]["status"][5] == "open"
    wrong(document, "claimed 'global', proved 'local'", argument__box__5=(0.0).hex())
    held = deepcopy(document)
    held["argument"]["box"][5], held["claims"]["scope"] = (0.0).hex(), "local"
    assert checker.check(held).startswith("proved")
    points = [[0.0, 0.0], [0.002, 0.0]]
    alone, both = (proof_of(scenes.on_sphere(each), 1e-5) for each in (points[1:], points))
    radii = [[(0.0).hex()], *alone["pressed"]["radii"]]
    wrong(both, "may touch is fixed open", argument__box__0=(0.0).hex(), pressed__radii=radii)


@pytest.mark.parametrize("place", [("load",), ("loads", 1), ("gaps", 5)])
def test_each_end_of_each_bound_counts(few: Any, place: tuple[Any, ...]) -> None:
    claimed = few["claims"][place[0]]
    low, high = map(float.fromhex, claimed[place[1]] if place[1:] else claimed)
    above, below = float(np.nextafter(low, np.inf)), float(np.nextafter(high, -np.inf))
    for bounds in ((above, high), (low, below), (high, low)):
        key = "__".join(map(str, ("claims", *place)))
        wrong(few, "not proved to be within", **{key: [bound.hex() for bound in bounds]})


NUMBERS = ("0x1p+1", "0x1.8p-1", " 0x1.0000000000000p+0", "1.0", "nan", "inf", "0x1p99999", None)


def test_numbers_are_written_one_way_and_what_is_damaged_is_named(few: Any) -> None:
    for text in NUMBERS:
        reason = r"radii \[0\] \[0\]: .* not a finite float64"
        wrong(few, reason, checker.Unreadable, pressed__radii__0=[text])
    for where in ("note", "claims__note", "argument__note", "pressed__note"):
        wrong(few, "expected a table", checker.Unreadable, **{where: "believe me"})
    for place, name in (
        *(("scene__tip_radii", "tip_radii"), ("scene__contact_modulus", "contact_modulus")),
        *(("argument__box", "box"), ("argument__shells", "shells"), ("sheared", "sheared")),
        *(("argument__convexity_number", "convexity_number"), ("pressed__radii", "radii")),
        *(("claims__gaps", "claims gaps"), ("claims__load", "claims load")),
    ):
        damaged = {place: "0x1.8"}
        wrong(few, f"^{name}: ", checker.Unreadable, sha256="fits", **damaged)


def test_an_asperity_that_is_dragged_along_is_refused() -> None:
    """One between six blunt ones loses load as the total rises, so regains some in shear."""
    tips, heights = [0.02, *[0.1] * 6], [-1e-5, *[0.0] * 6]
    contact = cr.press(
        scenes.on_sphere(0.0025 * ring(6), tips, heights, friction=0.5), approach=7.6e-5
    )
    assert contact.proof().document["claims"]["scope"] == "global"
    left = cr.press(contact.scene, load=0.99 * contact.load)
    assert left.loads[0] > contact.loads[0]
    far = cr.press(shaded(), load=2.96)  # its load grows much in shear
    for each, share in ((contact, 0.01), (far, 0.3)):
        with pytest.raises(cr.ProofError, match="dragged along"):
            each.proof(sheared=[SimpleNamespace(force=share * 0.5 * each.load)])


def test_a_loss_is_claimed_in_order_alone() -> None:
    """Four contacts where the middle one falls as the load rises, at first."""
    contact = cr.press(shaded(), load=2.96)
    state = cr.shear(contact, force=0.8 * 0.5 * contact.load)
    with pytest.raises(cr.ProofError, match="an indentation may fall"):
        contact.proof(sheared=[state])
    proof = contact.proof(sheared=[SimpleNamespace(force=state.force)])
    assert "(proved for one step)" in proof.proved
    assert "no loss is proved" in proof.proved
    document = copied(proof)
    claim = document["claims"]["shear"][0]
    assert (claim["order"], claim["loss"]) == ("proved for one step", None)
    wrong(document, "proved 'proved for one step'", claims__shear__0__order="proved")
    ordered = cr.press(replace(scenes.paper(), friction=0.5), approach=5e-5)
    state = cr.shear(ordered, force=0.4 * 0.5 * ordered.load)
    weaker = copied(ordered.proof(sheared=[state]))
    weaker["claims"]["shear"][0] |= {"order": "proved for one step", "loss": None}
    assert "(proved for one step)" in checker.check(weaker)
    wrong(document, "loss: claimed", claims__shear__0__loss=[(0.0).hex(), (1.0).hex()])


def test_shells_prove_what_eigenvalues_show() -> None:
    """Of random points and shells that overlap; a close pair up to where it turns indefinite."""
    rng = np.random.default_rng(7)
    given = proof_of(*scenes.scattered(5, 8, 0.5, 0.5))["scene"]
    accepted, overlapping = 0, 0
    for trial in range(150):
        points = rng.uniform(-1, 1, (8, 2)) if trial % 2 else rng.uniform(-9, 9, (8, 2))
        points[1] = points[0] + rng.uniform(0.01, 0.3, 2)
        given |= {"x": [x.hex() for x in points[:, 0]], "y": [y.hex() for y in points[:, 1]]}
        read = checker.read_scene(given)
        apart = np.hypot(*(points[:, None] - points).T)
        np.fill_diagonal(apart, np.inf)
        radii = np.pi / 2 * apart.min(axis=0) * 10 ** rng.uniform(-1.5, 0, 8)
        shells = radii * 2 / np.pi * 2.0 ** rng.uniform(0, 3)
        lengths = (list(map(Fraction, each.tolist())) for each in (shells, radii))
        try:
            checker.prove_by_shells(read, *lengths, list(range(8)))
        except Refused:
            continue
        accepted += 1
        overlapping += bool((shells[:, None] + shells > apart).any())
        assert np.linalg.eigvalsh(1 / (np.pi * apart) + np.diag(1 / (2 * radii))).min() > 0
    assert accepted > overlapping > 8


def test_intervals_hold_what_they_should() -> None:
    rng = random.Random(1)

    def random_number() -> Fraction:
        size = Fraction(2) ** rng.randrange(-400, 400)
        return Fraction(rng.randrange(-(10**50), 10**50), rng.randrange(1, 10**50)) * size

    for _ in range(300):
        x, y = random_number(), random_number()
        a, b = Interval(x), Interval(min(y, y / 3), max(y, y / 3))
        for held, value in ((a + b, x + y), (a - b, x - y), (a * b, x * y)):
            assert held.low <= value <= held.high
        assert (Interval(x) / abs(y)).low <= x / abs(y) <= (Interval(x) / abs(y)).high
        assert a.high - a.low <= abs(x) / 2**126
        root = Interval(abs(x)).root()
        assert root.low**2 <= abs(x) <= root.high**2
        assert root.high - root.low <= root.high / 2**120
    with pytest.raises(Refused, match="may be 0"):
        Interval(1) / Interval(-1, 1)
    with ctx.workdps(60):
        assert quotient(checker.PI.low) < arb.pi() < quotient(checker.PI.high)


def test_cholesky_finds_where_the_matrix_turns_indefinite() -> None:
    scene, _ = scenes.scattered(11, 12, 0.5, 0.5)
    read = checker.read_scene(proof_of(scene, 1e-9)["scene"])
    radii = np.random.default_rng(0).uniform(0.1, 1, 12)
    root, A = np.sqrt(2 * radii), coupling(exact(scene.contact_points), arb(1)).astype(float)
    end = -1 / np.linalg.eigvalsh(root[:, None] * A * root).min()
    for factor, definite in ((0.5, True), (1 - 1e-12, True), (1 + 1e-12, False), (2, False)):
        given = [Fraction(float(radius * end * factor)) for radius in radii]
        try:
            checker.prove_definite(read, given, list(range(12)))
            assert definite
        except Refused:
            assert not definite


def test_two_solutions_are_both_proved_and_neither_is_the_only_one() -> None:
    """Deep in two neighbours: one carries all and keeps the other open, or the other way round."""
    depth, scene = 1.0, scenes.on_sphere([[0, 0], [1.0, 0]], 9.0, radius=1e30)
    a = float(np.sqrt(scene.relative_radii[0] * depth))
    assert a > 3 * np.pi / 4  # then it pushes the other down by more than the approach
    document = proof_of(scene, 1e-9)
    for first, second in ((a, 0.0), (0.0, a)):
        box = [max(1.01 * x, 0.3).hex() for x in (first, second)]
        radii = [[first.hex()], [second.hex()]]
        document["argument"] |= {"box": box, "convexity_number": (0.99).hex(), "shells": None}
        document["pressed"] = {"radii": radii, "approach": [depth.hex()]}
        document["prescribed"] = {"approach": depth.hex()}
        document["sha256"] = checker.digest(document["scene"], document["prescribed"])
        proved = checker.prove(document)
        assert proved["scope"] == "local"
        assert proved["status"] == ["contact" if x else "open" for x in (first, second)]
        document["argument"] |= {"box": [(1.01 * a).hex()] * 2}
        with pytest.raises(Refused, match="breaks down"):
            checker.prove(document)


def judged(proof: Any) -> Any:
    """The claims of a proof that the checker accepts and the oracle finds true."""
    document = copied(proof)
    assert checker.check(document) == proof.proved
    assert false_claims(document) == []
    return document["claims"]


def both_controls(scene: cr.Scene, approach: float) -> list[cr.Contact]:
    contact = cr.press(scene, approach=approach)
    return [contact, cr.press(scene, load=contact.load)] if contact.load else [contact]


def small(name: str, friction: float | None = None) -> tuple[cr.Scene, float]:
    """The inner asperities of a named scene, of which some touch: exact arithmetic takes time."""
    scene, approach = scenes.EVERY[name]
    a = scene.asperities
    inner = cr.Asperities(a.positions[:19], a.tip_radii[:19], a.heights[:19])
    return replace(scene, asperities=inner, friction=friction), 0.4 * approach


def width(bounds: list[str]) -> float:
    low, high = (Fraction(float.fromhex(text)) for text in bounds)
    return float(high - low)


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", scenes.EVERY)
def test_named_scenes_are_proved_and_sharply(name: str) -> None:
    for contact in both_controls(*small(name)):
        claims = judged(contact.proof())
        assert claims["scope"] == "global"
        assert claims["status"] == list(contact.status)
        for bounds in claims["loads"]:  # neighbours among float64 numbers: no bound is sharper
            assert width(bounds) <= np.spacing(float.fromhex(bounds[0]))


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", ["paper", "rough, closest", "rough on cylinder, closest"])
def test_friction_states_and_losses_are_proved(name: str) -> None:
    for contact in both_controls(*small(name, friction=0.5)):
        forces = np.array([1e-6, 0.37, 0.99]) * 0.5 * contact.load
        states = [cr.shear(contact, force=float(force)) for force in forces]
        claims = judged(contact.proof(sheared=states))
        for state, claim in zip(states, claims["shear"], strict=True):
            assert claim["status"] == list(state.status)
            low, high = (float.fromhex(text) for text in claim["loss"])
            assert low <= cr.cycle(contact, maximum=state.force).loss <= high
            assert claim["order"] == "proved"
            assert width(claim["loss"]) < (1e-15 if state.force > forces[0] else 2e-7) * high


def test_random_scenes() -> None:
    """Where there is a certificate there is a proof, and no status of it is lost."""
    proved = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        make = scenes.scattered if seed % 2 else scenes.on_lattice
        count, crowding = int(rng.integers(1, 13)), float(rng.uniform(0.05, 2.0))
        roughness = float(rng.choice([0.0, 0.1, 0.5, 2.0]))
        for contact in both_controls(*make(seed, count, crowding, roughness)):
            if contact.certificate.scope == "none":
                continue
            try:
                proof = contact.proof()
            except cr.ProofError:  # the certificate alone has a status for crowded contacts
                assert contact.certificate.fixed_open or contact.crowding > 1
                continue
            claims = judged(proof)
            decided = contact.status != "undecided"
            assert (np.array(claims["status"]) == contact.status)[decided].all()
            proved += 1
    assert proved > 8


def test_the_bound_holds_where_the_energy_is_flattest() -> None:
    """Two equal contacts, as near to the end of convexity as is provable, off in opposite ways."""
    a, apart = 0.75 * np.pi / 2, 1.0
    scene = scenes.on_sphere([[0, 0], [apart, 0]], 1e3, radius=1e30)
    approach = a**2 / 1e3 * (1 + 4 * a / (3 * np.pi * apart))
    loads = cr.press(scene, approach=approach).loads
    claims = judged(prove(scene, loads * [1 + 1e-6, 1 - 1e-6], approach=approach))
    assert claims["scope"] == "global"


def test_crowded_contacts_are_proved_with_others_held_open() -> None:
    """Where the certificate has a status there is a proof, by overlapping shells or by Cholesky."""
    for sampled in ((9, 12, 3.0, 0.5), (2, 40, 2.5, 0.3), (9, 12, 4.0, 0.0)):
        scene, approach = scenes.scattered(*sampled)
        contact = cr.press(scene, approach=approach)
        assert contact.crowding > 1
        claims = judged(contact.proof())
        assert claims["scope"] == contact.certificate.scope == "local"
        assert claims["status"] == list(contact.status)


FORGERIES = int(os.environ.get("CONVEXROUGH_FORGERIES", "30"))


@cache
def honest() -> list[Any]:
    """Small proofs of every kind: controls, geometries, arguments, scopes, order."""
    heights = [0, -2e-6, -4e-6, -6e-6, -1e-5, -1.5e-5, -3e-5]  # the last is open
    seven = cr.Asperities(0.0025 * ring(6), 0.02, heights)
    proofs = []
    for geometry, friction in (("summit", 0.5), ("closest", None)):
        scene = cr.Scene(1.0, seven, scenes.MATERIAL, friction=friction, geometry=geometry)
        for each in both_controls(scene, 2e-5):
            forces = [0.3 * friction * each.load, 0.9 * friction * each.load] if friction else []
            proofs.append(each.proof(sheared=[SimpleNamespace(force=Q) for Q in forces]))
    lifted = cr.press(shaded(), load=2.96)
    proofs.append(lifted.proof(sheared=[SimpleNamespace(force=0.4 * lifted.load)]))
    loads = lifted.loads * (1 + 1e-3 * (np.arange(6) == 0))
    proofs.append(prove(lifted.scene, loads, load=2.96))
    for sampled in ((3, 5, 1.9, 0.5), (9, 6, 2.2, 0.1)):
        crowded, approach = scenes.scattered(*sampled)
        proofs.append(cr.press(crowded, approach=approach).proof())
    by_cholesky = copied(proofs[-1])
    by_cholesky["argument"] |= {"shells": None, "convexity_number": (0.999).hex()}
    return [*map(copied, proofs), by_cholesky]


def leaves(tree: Any, at: Place = ()) -> list[Place]:
    """Where the strings are."""
    if isinstance(tree, str):
        return [at]
    items = tree.items() if isinstance(tree, dict) else enumerate(tree or ())
    return [path for key, value in items for path in leaves(value, (*at, key))]


def a_number(rng: random.Random, document: Any, *under: str) -> Place:
    start = look(document, under)
    return rng.choice([(*under, *p) for p in leaves(start) if "0x" in look(start, p)])


def one_text(rng: random.Random, document: Any) -> Any:
    """A number that is a little off, or anything else that a proof contains, or an odd thing."""
    part = rng.choice([(), ("claims",), ("claims", "status"), ("scene",), ("prescribed",)])
    if rng.random() < 0.5:
        other = rng.choice(honest())
        odd = ["nan", "0x1.8p+99999", "1e-3", "", None, 1, [], {}, (5e-324).hex(), (1e150).hex()]
        new = rng.choice([look(other, rng.choice(leaves(other))), (-1.0).hex(), rng.choice(odd)])
        put(document, (*part, *rng.choice(leaves(look(document, part)))), new)
        return document
    path = a_number(rng, document, *part[:1])
    value = float.fromhex(look(document, path))
    change = 2.0 ** rng.uniform(-60, 2) * rng.choice([1, -1])
    changed = value * (1 + change) if value else change * 1e-9
    if changed == value:
        changed = float(np.nextafter(value, rng.choice([-np.inf, np.inf])))
    put(document, path, changed.hex())
    return document


def tighter_bound(rng: random.Random, document: Any) -> Any:
    """By less than its width: what is left may still hold the truth, and may not be proved."""
    path = a_number(rng, document, "claims")[:-1]
    low, high = (float.fromhex(text) for text in look(document, path))
    cut = rng.choice([0.01, 0.3, 0.6, 0.99]) * (high - low)
    low, high = rng.choice([(low + cut, high), (low, high - cut), (high, high), (high, low)])
    put(document, path, [low.hex(), high.hex()])
    return document


def swapped_part(rng: random.Random, document: Any) -> Any:
    """All that another proof claims, or its scene, what it prescribes, its friction."""
    other = deepcopy(rng.choice(honest()))
    part = rng.choice(["scene", "claims", "prescribed", "sheared"])
    document[part] = other[part]
    if part == "sheared":
        document["claims"]["shear"] = other["claims"]["shear"]
    return document


def changed_box(rng: random.Random, document: Any) -> Any:
    factor = 2.0 ** (rng.uniform(-3, 3) * rng.choice([1, 0.01]))
    which = rng.choice(["box", "shells", "box", "one", "theta"])
    argument = document["argument"]
    if which == "theta" or (which == "shells" and argument["shells"] is None):
        argument["convexity_number"] = rng.uniform(0, 1.2).hex()
    elif which == "one":
        put(argument["box"], (rng.randrange(len(argument["box"])),), (0.0).hex())
    else:
        argument[which] = scaled(argument[which], factor)
    return document


FORGED = [one_text, tighter_bound, swapped_part, changed_box]


def forged(rng: random.Random) -> tuple[str, bytes]:
    """How, and the file: one or two forgeries, mostly under a hash that fits, at times torn."""
    document, names = deepcopy(rng.choice(honest())), []
    for _ in range(rng.choice([1, 1, 1, 2])):
        forge = rng.choice(FORGED)
        try:
            document = forge(rng, document)
        except (LookupError, TypeError, ValueError, AttributeError):
            continue  # the second finds no place after the first
        names.append(forge.__name__)
    if rng.random() < 0.8 and {"scene", "prescribed", "sha256"} <= set(document):
        document["sha256"] = checker.digest(document["scene"], document["prescribed"])
        names.append("hash")
    contents = json.dumps(document).encode()
    if rng.random() < 0.1:
        names.append("torn")
        place = rng.randrange(len(contents))
        contents = rng.choice([contents[:place], contents[:place] + contents[place + 1 :]])
    return "+".join(names), contents


def test_no_forgery_that_is_accepted_claims_something_false(tmp_path: Path) -> None:
    outcomes, path = Counter[int](), tmp_path / "proof.json"
    for seed in range(FORGERIES):
        how, contents = forged(random.Random(seed))
        path.write_bytes(contents)
        status = checker.main([str(path)])
        outcomes[status] += 1
        if status == 0:
            assert not false_claims(json.loads(contents)), (seed, how)
    print(outcomes)
    assert {*outcomes} == {0, 1, 2}  # accepted, refused, unreadable
    assert min(outcomes.values()) > FORGERIES / 50
