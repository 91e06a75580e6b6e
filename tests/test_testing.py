"""What downstream tests call: it must pass what is right, and say what is wrong."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import PAPER_APPROACH, paper, twins

import convexrough as cr
from convexrough.testing import assert_agree, assert_certified, assert_shear_certified

PAGE = Path(__file__).parent.parent / "docs" / "how-to" / "test-your-solver.md"


@pytest.fixture(scope="module")
def contact() -> cr.Contact:
    return cr.press(paper(), approach=PAPER_APPROACH)


def failure(call: Any, *arguments: Any, **options: Any) -> str:
    """The message of the assertion that fails."""
    with pytest.raises(AssertionError) as caught:
        call(*arguments, **options)
    return str(caught.value)


def test_the_page_shows_what_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    """The message of a failed check; test_documents.py runs the other blocks."""
    first, second = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.M | re.S)[:2]
    exec(first + second, {})
    printed = capsys.readouterr().out.strip()
    assert printed in PAGE.read_text()
    assert "claimed open, proved to touch: 1" in printed


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


def test_discs_that_overlap_are_warned_of() -> None:
    scene = cr.Scene(1.0, cr.Asperities([[0, 0], [0.01, 0]], 0.1), cr.Material(1.0, 0.3))
    loads = cr.press(scene, load=1e-5).loads
    with pytest.warns(UserWarning, match="contact discs overlap") as warned:
        assert_certified(scene, loads, load=1e-5)
    assert warned[0].filename == __file__
    with pytest.warns(UserWarning, match="contact discs overlap"):
        failure(assert_certified, scene, 2 * loads, load=1e-5)


def test_loads_not_certified_as_closely_as_asked(contact: cr.Contact) -> None:
    loads = np.array(contact.loads)
    loads[5] *= 1 + 1e-4
    assert_certified(paper(), loads, approach=PAPER_APPROACH)  # the statuses are still proved
    message = failure(assert_certified, paper(), loads, approach=PAPER_APPROACH, within=1e-6)
    error = re.search(r"at most (\S+) of the largest load \(1e-06 allowed", message)
    assert error is not None
    assert 1e-6 < float(error[1]) < 1e-3
    assert first_named(message, "load error") == 5  # the guilty one


def test_shear_forces() -> None:
    pressed = cr.press(replace(paper(), friction=0.5), approach=PAPER_APPROACH)
    force = 0.25 * pressed.load
    state = cr.shear(pressed, force=force)
    certificate = assert_shear_certified(pressed, state.forces, force=force, within=1e-10)
    assert list(certificate.status) == list(state.status)
    slides = np.where(np.arange(61) == 4, 0.5 * pressed.loads, state.forces)  # it does not
    message = failure(assert_shear_certified, pressed, slides, force=force)
    assert first_named(message, "  claimed to slide, proved not to: 1") == 4
    message = failure(assert_shear_certified, pressed, state.forces, force=force * 1.02)
    assert "the total force is not the prescribed one" in message.splitlines()[0]


def test_nothing_to_prove() -> None:
    dense, load = twins()
    loads = cr.press(dense, load=load).loads
    message = failure(assert_certified, dense, loads, load=load)
    assert message.startswith("nothing is proved about the loads: ")
    assert "convexity number" in message
    found = failure(assert_agree, loads, loads, scene=dense, load=load)
    assert found.startswith("nothing is proved about the loads of first: ")


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


def test_loads_of_the_other_sign(contact: cr.Contact) -> None:
    """The error names the sign, and its traceback shows the line of the test alone."""
    with pytest.raises(cr.InputError, match="expected compression to be positive") as caught:
        assert_certified(paper(), -contact.loads, approach=PAPER_APPROACH)
    shown = [each for each in caught.traceback if "__tracebackhide__" not in each.frame.f_locals]
    assert [Path(each.path).name for each in shown] == [Path(__file__).name]
