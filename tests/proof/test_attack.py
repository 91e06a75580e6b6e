"""Forged proof files: whatever the checker accepts is true by the 50-digit reference."""

import json
import os
import random
from collections import Counter
from copy import deepcopy
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import proof_oracle
import scenes
from friction_scenes import ring, shaded

import convexrough as cr
from convexrough import checker
from convexrough.proof import prove

FORGERIES = int(os.environ.get("CONVEXROUGH_FORGERIES", "30"))

Place = tuple[Any, ...]


@cache
def honest() -> list[Any]:
    """Small proofs of every kind: controls, geometries, arguments, scopes, order."""
    heights = [0, -2e-6, -4e-6, -6e-6, -1e-5, -1.5e-5, -3e-5]  # the last is open
    seven = cr.Asperities(0.0025 * ring(6), 0.02, heights)
    proofs = []
    for geometry, friction in (("summit", 0.5), ("closest", None)):
        scene = cr.Scene(1.0, seven, scenes.MATERIAL, friction=friction, geometry=geometry)
        contact = cr.press(scene, approach=2e-5)
        for each in (contact, cr.press(scene, load=contact.load)):
            forces = [0.3 * friction * each.load, 0.9 * friction * each.load] if friction else []
            proofs.append(each.proof(sheared=[SimpleNamespace(force=Q) for Q in forces]))
    lifted = cr.press(shaded(), load=2.96)
    proofs.append(lifted.proof(sheared=[SimpleNamespace(force=0.4 * lifted.load)]))
    loads = lifted.loads * (1 + 1e-3 * (np.arange(6) == 0))
    proofs.append(prove(lifted.scene, loads, load=2.96))
    for sampled in ((3, 5, 1.9, 0.5), (9, 6, 2.2, 0.1)):
        crowded, approach = scenes.scattered(*sampled)
        proofs.append(cr.press(crowded, approach=approach).proof())
    documents = [json.loads(json.dumps(proof.document)) for proof in proofs]
    by_cholesky = deepcopy(documents[-1])
    by_cholesky["argument"] |= {"shells": None, "convexity_number": (0.999).hex()}
    documents.append(by_cholesky)
    return documents


def leaves(tree: Any, at: Place = ()) -> list[Place]:
    """Where the strings are."""
    if isinstance(tree, str):
        return [at]
    items = tree.items() if isinstance(tree, dict) else enumerate(tree or ())
    return [path for key, value in items for path in leaves(value, (*at, key))]


def look(tree: Any, path: Place) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def put(tree: Any, path: Place, value: Any) -> None:
    look(tree, path[:-1])[path[-1]] = value


def a_number(rng: random.Random, document: Any, *under: str) -> Place:
    start = look(document, under)
    return rng.choice([(*under, *p) for p in leaves(start) if "0x" in look(start, p)])


def one_number(rng: random.Random, document: Any) -> Any:
    part = rng.choice([(), ("claims",), ("scene",), ("prescribed",)])
    path = a_number(rng, document, *part)
    if rng.random() < 0.2:
        odd = ["nan", "0x1.8p+99999", "1e-3", "", None, 1, [], {}, (5e-324).hex(), (1e150).hex()]
        put(document, path, rng.choice([*odd, (0.0).hex(), (-1.0).hex()]))
        return document
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


def one_status(rng: random.Random, document: Any) -> Any:
    claimed = ["contact", "open", "undecided", "sliding", "partial", "global", "local", ""]
    claimed += ["proved", "proved for one step"]
    claims = document["claims"]
    path = rng.choice([p for p in leaves(claims) if look(claims, p) in claimed])
    put(claims, path, rng.choice(claimed))
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
        argument[which] = [(factor * float.fromhex(text)).hex() for text in argument[which]]
    return document


def changed_radii(rng: random.Random, document: Any) -> Any:
    place = rng.choice([document["pressed"], *(each["held"] for each in document["sheared"])])
    radii = place["radii"]
    radii[rng.randrange(len(radii))] = rng.choice([[(0.0).hex()], rng.choice(radii), []])
    return document


FORGED = [one_number, tighter_bound, one_status, swapped_part, changed_box, changed_radii]


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


def judge(seed: int, folder: Path) -> str:
    """What the checker says of a forgery; the forgery must be true if it accepts."""
    rng = random.Random(seed)
    how, contents = forged(rng)
    path = folder / "proof.json"
    path.write_bytes(contents)
    status = checker.main([str(path)])
    if status == 0:
        document = json.loads(contents)
        assert not proof_oracle.false_claims(document), (seed, how)
    assert status in (0, 1, 2)
    return ("accepted", "refused", "unreadable")[status]


def test_no_forgery_that_is_accepted_claims_something_false(tmp_path: Path) -> None:
    outcomes = Counter(judge(seed, tmp_path) for seed in range(FORGERIES))
    assert all(outcomes[what] > FORGERIES / 50 for what in ("accepted", "refused", "unreadable"))
    print(outcomes)
