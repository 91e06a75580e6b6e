"""Honest proofs: accepted, true by the 50-digit reference, and not weaker than the certificate."""

import json
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import proof_oracle
import pytest
import scenes

import convexrough as cr
from convexrough import checker
from convexrough.proof import prove


def judged(proof: Any) -> Any:
    """The claims of a proof that the checker accepts and the oracle finds true."""
    document = json.loads(json.dumps(proof.document))
    assert checker.check(document) == proof.proved
    assert proof_oracle.false_claims(document) == []
    return document["claims"]


def both_controls(scene: cr.Scene, approach: float) -> list[cr.Contact]:
    contact = cr.press(scene, approach=approach)
    return [contact, cr.press(scene, load=contact.load)] if contact.load else [contact]


def small(name: str, friction: float | None = None) -> tuple[cr.Scene, float]:
    """The inner asperities of a named scene, of which some touch: exact arithmetic takes time."""
    scene, approach = scenes.NAMED[name]
    a = scene.asperities
    inner = cr.Asperities(a.positions[:19], a.tip_radii[:19], a.heights[:19])
    return replace(scene, asperities=inner, friction=friction), 0.4 * approach


def width(bounds: list[str]) -> float:
    low, high = (Fraction(float.fromhex(text)) for text in bounds)
    return float(high - low)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", scenes.NAMED)
def test_named_scenes_are_proved_and_sharply(name: str) -> None:
    for contact in both_controls(*small(name)):
        claims = judged(contact.proof())
        assert claims["scope"] == "global"
        assert claims["status"] == list(contact.status)
        for bounds in claims["loads"]:  # neighbours among float64 numbers: no bound is sharper
            assert width(bounds) <= np.spacing(float.fromhex(bounds[0]))


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["paper", "rough, closest"])
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
