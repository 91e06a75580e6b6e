"""`verify` and the assertions of `testing`: wrong claims are found, and nothing wrong passes."""

import re
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scenes import MATERIAL, PAPER_APPROACH, hexagonal, paper, prescribed, scattered, twins

import convexrough as cr
from convexrough.friction.verdict import verify_shear
from convexrough.testing import assert_agree, assert_certified, assert_shear_certified


@pytest.fixture(scope="module")
def contact() -> cr.Contact:
    return cr.press(paper(), approach=PAPER_APPROACH)


@cache
def solved(seed: int, control: str) -> tuple[cr.Contact, dict[str, float]]:
    scene, approach = scattered(seed, 30, 0.2 + 0.02 * (seed % 25), [0.1, 0.3, 0.6][seed % 3])
    given = prescribed(scene, approach, control)
    return cr.press(scene, **given), given


def corrupted(contact: cr.Contact, kind: str, rng: Any) -> tuple[Any, set[int]]:
    """Loads with one thing wrong, and who is guilty; nobody where that is not possible."""
    loads, largest = contact.loads.copy(), contact.loads.max()
    among = np.flatnonzero((loads == 0) == (kind == "added"))
    if len(among) == 0:
        return loads, set()
    guilty = rng.choice(among, 2 if kind == "swapped" else 1, replace=False)
    if kind == "added":
        loads[guilty] = largest * 10 ** rng.uniform(-5, 0)
    elif kind == "swapped":
        loads[guilty] = loads[guilty[::-1]]
        guilty = guilty[: 0 if np.ptp(loads[guilty]) < 1e-9 * largest else 2]
    else:
        loads[guilty] *= 0.0 if kind == "dropped" else 10 ** rng.uniform(-2, 2)
    return loads, {*guilty.tolist()}


@pytest.mark.sample(4)
@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("seeds", [range(k, k + 5) for k in range(0, 50, 5)], ids=str)
@pytest.mark.parametrize("kind", ["dropped", "added", "scaled", "swapped"])
def test_single_corruptions(kind: str, seeds: range, control: str) -> None:
    """Some 1,700 in all: the guilty one is named first, and none passes."""
    rng, first, tried = np.random.default_rng(seeds[0]), 0, 0
    for seed in seeds:
        contact, given = solved(seed, control)
        if np.count_nonzero(contact.loads) < 3:
            continue
        for _ in range(5):
            loads, guilty = corrupted(contact, kind, rng)
            if not guilty:
                continue
            verdict = cr.verify(contact.scene, loads, **given, within=1e-6)
            assert not verdict.holds
            wrong = (loads > 0) != (contact.loads > 0)
            assert set(verdict.wrongly_open) <= set(np.flatnonzero(wrong & (loads == 0)))
            assert set(verdict.wrongly_loaded) <= set(np.flatnonzero(wrong & (loads > 0)))
            if wrong.any():  # also where no load has to be near
                assert not cr.verify(contact.scene, loads, **given, within=1).holds
            tried += 1
            first += int(verdict.suspects[0]) in guilty
            if kind == "swapped":
                assert set(verdict.suspects[:2].tolist()) == guilty
    assert tried > 5
    assert first >= tried - 1


def test_a_small_load_that_is_missing_does_not_pass() -> None:
    """Loads may be good enough for every status; the given set still has to be the proved one."""
    passed = 0
    for seed in range(40):
        contact, given = solved(seed, "approach")
        share = contact.loads / contact.loads.max()
        small = np.flatnonzero((share > 0) & (share < 0.02))
        for i in small[:1]:
            loads = contact.loads.copy()
            loads[i] = 0.0
            verdict = cr.verify(contact.scene, loads, **given)
            assert verdict.wrongly_open.tolist() == [i]
            assert not verdict.holds
            passed += verdict.certificate.all_proved
    assert passed > 5  # whose statuses alone say that all is well


def test_a_verdict_is_about_one_solution() -> None:
    """Of two solutions, both 60 % of the largest load away, the certificate of these loads proves
    one, and Newton's method finds the other."""
    x = [-0.0162845424986, -0.0160084160543, -0.0096381664579, -0.0094958173350, 0.0115592395980]
    y = [-0.0041901197099, -0.0040715169275, -0.0128326399868, -0.0127356954124, 0.0014032433119]
    tips = [0.0250543610961, 0.0176714912943, 0.0237542897971, 0.0130631034335, 0.0227821938681]
    heights = [8.54561406887e-06, 5.85066476367e-06, -7.42799161516e-06, 7.58512260295e-06,
               -1.09425554780e-05]  # fmt: skip
    scene = cr.Scene(np.inf, cr.Asperities(np.column_stack((x, y)), tips, heights), MATERIAL)
    loads = [1.3560739e-09, 3.4691122e-08, 0.0, 4.5960501e-08, 7.4320817e-09]
    approach = 2.6275812228551447e-05
    other = cr.press(scene, approach=approach, start=loads)
    verdict = cr.verify(scene, loads, approach=approach, within=0.5)
    assert verdict.certificate.scope == "local"
    assert other.status.tolist() != verdict.solution.status.tolist()
    assert not verdict.holds
    assert verdict.error > 0.59


def test_wrong_loads_do_not_pass_as_true(contact: cr.Contact) -> None:
    half = 0.5 * contact.loads
    assert cr.verify(paper(), contact.loads, approach=PAPER_APPROACH)
    assert not cr.verify(paper(), half, approach=PAPER_APPROACH)
    with pytest.raises(TypeError, match=r"all_proved.*verify"):
        bool(cr.certify(paper(), half, approach=PAPER_APPROACH))

    def solve(problem: Any, start: Any) -> Any:
        loads = half[problem.candidates] / problem.units.force
        return cr.solvers.Solution.of(problem, loads, problem.approach, 0)

    halves: Any = SimpleNamespace(name="half", solve=solve)
    wrong = cr.press(paper(), approach=PAPER_APPROACH, solver=halves)
    (said,) = {*wrong.warnings} - {*contact.warnings}
    assert said.startswith("the loads err by up to")


def test_totals_in_another_unit(contact: cr.Contact) -> None:
    verdict = cr.verify(paper(), 1e3 * contact.loads, load=contact.load)
    assert verdict.certificate.all_proved  # the set is right
    assert not verdict.total_holds
    assert not verdict.holds
    assert verdict.total_given / verdict.total_prescribed == pytest.approx(1e3)
    assert cr.verify(paper(), contact.loads * (1 + 1e-3), load=contact.load).holds
    assert not cr.verify(paper(), contact.loads * (1 + 2e-2), load=contact.load).total_holds
    assert cr.verify(paper(), contact.loads * (1 + 2e-2), load=contact.load, within=0.05).holds


@pytest.mark.parametrize("wrong", ["turned", "too high"])
def test_loads_that_are_far_off_do_not_hold_by_default(wrong: str) -> None:
    """Their set is right, and proved from these loads alone."""
    scene = hexagonal(within=0.0051, height_std=1e-6, seed=3)
    contact = cr.press(scene, load=4e-7)
    loads, control = 1.2 * contact.loads, {"approach": contact.approach}
    if wrong == "turned":
        x, y = scene.asperities.positions.T
        c, s = np.cos(np.pi / 3), np.sin(np.pi / 3)
        apart = np.hypot((c * x - s * y)[:, None] - x, (s * x + c * y)[:, None] - y)
        loads, control = contact.loads[apart.argmin(axis=1)], {"load": 4e-7}
    verdict = cr.verify(scene, loads, **control)
    assert not verdict.holds
    assert not len(verdict.wrongly_claimed)
    assert cr.verify(scene, loads, **control, within=1.0).holds
    # Errors are fractions of the solution's largest load, where the given loads are larger.
    verdict = cr.verify(scene, 1e3 * contact.loads, approach=contact.approach, within=1.0)
    assert not verdict.holds
    assert verdict.error == pytest.approx(999, rel=1e-6)


def test_exchanged_coordinates_of_a_square_array() -> None:
    """Positions match all the same; only the loads tell."""
    asperities = cr.Asperities.square(
        spacing=0.0025, tip_radius=0.02, within=0.0102, height_std=2e-6, seed=3
    )
    scene = cr.Scene(1.0, asperities, MATERIAL, friction=0.5, geometry="summit")
    contact = cr.press(scene, approach=PAPER_APPROACH)
    state = cr.shear(contact, force=0.1 * contact.load)
    points = asperities.positions
    noise = np.random.default_rng(0).uniform(0.995, 1.005, len(points))  # as sums of pixels have
    for moved, said in (
        (points[:, ::-1], "x and y exchanged"),
        (points * [-1, 1], "the other sign of x"),
        (points * [1, -1], "the other sign of y"),
        (-points, "the other sign of x and y"),
        (points[:, ::-1] * [1, -1], "the array turned by -90 degrees"),
    ):
        partners = [int(np.hypot(*(points - place).T).argmin()) for place in moved]
        for loads in (contact.loads[partners], contact.loads[partners] * noise):
            verdict = cr.verify(scene, loads, approach=PAPER_APPROACH)
            assert not verdict.holds
            assert f"the loads are right with {said}" in list(verdict.hints())
        sheared = verify_shear(contact, state.forces[partners], force=0.1 * contact.load)
        assert f"the shear forces are right with {said}" in list(sheared.hints())
    wrong = verify_shear(contact, state.forces, force=0.1 * contact.load, sliding=False)
    assert not wrong.holds
    assert list(wrong.hints()) == []  # the forces are right, the statuses are not
    unlike = cr.verify(scene, np.roll(contact.loads, 7), approach=PAPER_APPROACH)
    assert not any("the loads are right" in hint for hint in unlike.hints())
    tiny = cr.verify(scene, 1e-312 * contact.loads, approach=PAPER_APPROACH)
    assert list(tiny.hints()) == []  # the solution's loads, divided by the largest, overflow


@pytest.mark.parametrize("factor", [0.9, 0.98, 1.02, 3.0, 1000.0])
def test_a_common_factor_makes_no_suspects(contact: cr.Contact, factor: float) -> None:
    """All loads are equally wrong, so differences of rounding size say nothing."""
    verdict = cr.verify(contact.scene, contact.loads * factor, approach=PAPER_APPROACH)
    assert not verdict.holds
    assert len(verdict.suspects) == 0
    assert f"{factor:g} times" in "".join(verdict.hints()) or factor == 1000.0
    first = cr.press(contact.scene, approach=1e-6)  # of a single asperity its load is wrong
    alone = cr.verify(contact.scene, first.loads * factor, approach=1e-6)
    assert alone.suspects.tolist() == np.flatnonzero(first.loads).tolist()


@pytest.mark.parametrize("kind", [Fraction, Decimal])
def test_exact_numbers_of_python_are_accepted(kind: Any) -> None:
    load, scene = kind("1e-7"), paper()
    contact = cr.press(scene, load=load)
    assert contact.load == pytest.approx(1e-7)
    assert cr.verify(scene, contact.loads, load=load, within=kind("0.01")).holds
    assert cr.program(scene, load=load).constant == cr.program(scene, load=1e-7).constant


def failure(call: Any, *arguments: Any, **options: Any) -> str:
    """The message of the assertion that fails."""
    with pytest.raises(AssertionError) as caught:
        call(*arguments, **options)
    return str(caught.value)


def test_the_page_shows_what_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    """The message of a failed check; test_documents.py runs the other blocks."""
    page = Path(__file__).parents[1].joinpath("docs/how-to/test-your-solver.md").read_text()
    first, second = re.findall(r"^```python\n(.*?)^```", page, re.M | re.S)[:2]
    exec(first + second, {})
    printed = capsys.readouterr().out.strip()
    assert printed in page
    assert "claimed open, proved to touch: 1" in printed


def first_named(message: str, line: str) -> int:
    """The first asperity of the table below a line."""
    _, _, row, *_ = message[message.index(f"\n{line}") + 1 :].splitlines()
    return int(row.split()[0])


def test_discs_that_overlap_are_warned_of() -> None:
    scene = cr.Scene(1.0, cr.Asperities([[0, 0], [0.01, 0]], 0.1), cr.Material(1.0, 0.3))
    loads = cr.press(scene, load=1e-5).loads
    with pytest.warns(UserWarning, match="contact discs overlap") as warned:
        assert_certified(scene, loads, load=1e-5)
    assert warned[0].filename == __file__
    with pytest.warns(UserWarning, match="contact discs overlap"):
        failure(assert_certified, scene, 2 * loads, load=1e-5)


def test_loads_not_certified_as_closely_as_asked(contact: cr.Contact) -> None:
    loads = np.where(np.arange(61) == 5, 1 + 1e-4, 1.0) * contact.loads
    still = assert_certified(paper(), list(loads), approach=PAPER_APPROACH)
    assert list(still.status) == list(contact.status)
    message = failure(assert_certified, paper(), loads, approach=PAPER_APPROACH, within=1e-6)
    assert first_named(message, "load error        at most ") == 5  # the guilty one


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
    given = {control: getattr(contact, control)}
    first = cr.press(paper(), **given)
    second = cr.press(paper(), **given, solver=cr.solvers.BristleQP(newton_step=False))
    assert_agree(first, second)
    assert_agree(first, second, within=1e-3)
    assert_agree(second.loads, first, scene=paper(), **given)
    numbers = {name: np.float64(value) for name, value in given.items()}
    assert_agree(first, second.loads, scene=paper(), **numbers)
    message = failure(assert_agree, first, second, within=1e-6)
    assert message.startswith("first (newton) and second (bristles): loads differ by ")
    assert "expected 1e-06: asperities " in message
    for wrong in (1000 * first.loads, first.loads + first.loads.max(), first.loads[::-1]):
        message = failure(assert_agree, first, wrong, scene=paper(), **given)
        assert "expected 0.01: asperities " in message, message
