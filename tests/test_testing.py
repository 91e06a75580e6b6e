"""What downstream tests call: it must pass what is right, and say what is wrong."""

from typing import Any

import numpy as np
import pytest
from scenes import PAPER_APPROACH, paper

import convexrough as cr
from convexrough.testing import assert_agree, assert_certified, assert_shear_certified


@pytest.fixture(scope="module")
def contact() -> cr.Contact:
    return cr.press(paper(), approach=PAPER_APPROACH)


def failure(call: Any, *arguments: Any, **options: Any) -> str:
    """The message of the assertion that fails."""
    with pytest.raises(AssertionError) as caught:
        call(*arguments, **options)
    return str(caught.value)


def first_named(message: str, line: str) -> int:
    """The first asperity of the table below a line."""
    lines = message.splitlines()
    at = next(i for i, each in enumerate(lines) if each.startswith(line))
    return int(lines[at + 2].split()[0])


@pytest.mark.parametrize("control", ["approach", "load"])
def test_certified(contact: cr.Contact, control: str) -> None:
    prescribed = {control: getattr(contact, control)}
    certificate = assert_certified(paper(), contact.loads, **prescribed, within=1e-11)
    assert list(certificate.status) == list(contact.status)
    assert_certified(paper(), list(contact.loads), **prescribed)


def test_shear_forces() -> None:
    scene = cr.Scene(1.0, paper().asperities, paper().material, friction=0.5, geometry="summit")
    pressed = cr.press(scene, approach=PAPER_APPROACH)
    force = 0.25 * pressed.load
    state = cr.shear(pressed, force=force)
    certificate = assert_shear_certified(pressed, state.forces, force=force, within=1e-10)
    assert list(certificate.status) == list(state.status)
    spoiled = np.array(state.forces)
    spoiled[4] = 0.5 * pressed.loads[4]  # at f P, though it does not slide
    message = failure(assert_shear_certified, pressed, spoiled, force=force)
    assert first_named(message, "  claimed to slide, proved not to: 1") == 4
    claims = state.status == "sliding"
    message = failure(
        assert_shear_certified, pressed, state.forces, force=force, sliding=claims & False
    )
    assert claims[first_named(message, f"  claimed to stick, proved to slide: {claims.sum()}")]
    rough = np.array(state.forces)
    rough[2] *= 1 + 1e-4
    message = failure(assert_shear_certified, pressed, rough, force=force, within=1e-6)
    assert first_named(message, "force error") == 2
    message = failure(assert_shear_certified, pressed, state.forces, force=force * 1.02)
    assert "the total force is not the prescribed one" in message.splitlines()[0]


@pytest.mark.parametrize("control", ["approach", "load"])
def test_two_that_agree(contact: cr.Contact, control: str) -> None:
    prescribed = {control: getattr(contact, control)}
    first = cr.press(paper(), **prescribed)
    second = cr.press(paper(), **prescribed, solver=cr.solvers.BristleQP(newton_step=False))
    assert_agree(first, second)
    assert_agree(first, second, within=1e-3)
    assert_agree(second.loads, first, scene=paper(), **prescribed)
    message = failure(assert_agree, first, second, within=1e-6)
    assert message.startswith("first (newton) and second (bristles): loads differ by ")
    assert "expected 1e-06: asperities " in message
    for wrong in (1000 * first.loads, first.loads + first.loads.max(), first.loads[::-1]):
        message = failure(assert_agree, first, wrong, scene=paper(), **prescribed)
        assert "expected 0.01: asperities " in message, message
