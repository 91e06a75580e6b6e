"""Which scenes a sweep has, in which order, and what a file may say of them."""

import itertools
from pathlib import Path
from typing import Any

import pytest
from sweep_files import SMALL, sweeping, tables, toml

import convexrough as cr
from convexrough.sweeps.file import plan_of
from convexrough.sweeps.grid import Draw, Grid
from convexrough.sweeps.plan import Plan


def plan(contents: dict[str, Any]) -> Plan:
    return plan_of(contents, Path("sweep.toml"))


def mistakes(contents: dict[str, Any]) -> str:
    with pytest.raises(cr.InputError) as caught:
        plan(contents)
    return str(caught.value)


def test_rows_are_in_the_order_of_lists_then_grid_then_seeds() -> None:
    together = (("sphere.radius", (1.0, 2.0)), ("material.poisson_ratio", (0.1, 0.2)))
    over = (("normal.load", (1, 2, 3)), ("asperities.height_std", (0.0, 1.0)))
    grid = Grid({"asperities": {}}, together, over, seeds=[7, 5])
    assert grid.count == 2 * 3 * 2 * 2
    found = [grid.point(i) for i in range(grid.count)]
    expected = itertools.product([(1.0, 0.1), (2.0, 0.2)], (1, 2, 3), (0.0, 1.0), (7, 5))
    for point, (both, load, height, seed) in zip(found, expected, strict=True):
        assert tuple(point.values.values()) == (*both, load, height)
        assert point.seed == seed


def test_a_sweep_of_any_length_is_counted_at_once() -> None:
    grid = Grid(
        {"asperities": {}}, over=(("normal.load", tuple(range(10))),) * 3, seeds=range(10**18)
    )
    assert grid.count == 10**21
    assert grid.point(10**21 - 1).seed == 10**18 - 1


def test_draws_belong_to_the_seed_alone() -> None:
    def samples(*draws: Draw) -> list[float]:
        grid = Grid({"asperities": {}}, (), (("normal.load", (1, 2)),), draws, range(5))
        return [grid.point(i).values["friction.coefficient"] for i in range(grid.count)]

    friction = Draw("friction.coefficient", "uniform", 0.2, 0.6)
    alone = samples(friction)
    assert alone[:5] == alone[5:]
    assert len(set(alone)) == 5
    assert all(0.2 <= value <= 0.6 for value in alone)
    assert samples(Draw("sphere.radius", "normal", 1.0, 0.1), friction) == alone


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    "changed",
    [
        tables(sphere={"radius": 1.1}),
        tables(sweep={"seeds": 5}),
        tables(sweep={"measure": ["load"]}),
        tables(sweep={"seeds": [0, 1, 2, 4]}),
        tables(cycle={"maximum_fraction": [0.38]}),
        tables(sweep={"over": {"normal.load": [1e-7, 3e-7], "asperities.height_std": [0.0, 1e-6]}}),
    ],
)
def test_whatever_numbers_depend_on_is_in_the_hash(changed: dict[str, Any]) -> None:
    assert plan(changed).manifest["sweep"] != plan(SMALL).manifest["sweep"]


def test_the_contents_of_a_file_of_asperities_are_in_the_hash(tmp_path: Path) -> None:
    contents = tables(asperities={"pattern": "file", "path": "a.csv"})
    contents["asperities"] = {"pattern": "file", "path": "a.csv"}
    contents["sweep"] = {"measure": ["load"], "over": {"normal.load": [1e-7]}}
    identities = set()
    for x in (0.0, 1e-4):
        (tmp_path / "a.csv").write_text(f"x,y,tip_radius\n{x},0.0,0.02\n")
        identities.add(plan_of(contents, tmp_path / "sweep.toml").manifest["sweep"])
    assert len(identities) == 2


WRONG = {
    "no table": ({k: v for k, v in SMALL.items() if k != "sweep"}, "[sweep]: missing table"),
    "a number": ({**SMALL, "sweep": 3}, "[sweep]: found 3, expected a table"),
    "unknown key": (tables(sweep={"sede": 3}), '[sweep] sede: unknown key, did you mean "seeds"?'),
    "unknown swept key": (
        sweeping(over={"asperities.hieght_std": [1.0]}),
        '[asperities] hieght_std: unknown key, did you mean "height_std"?',
    ),
    "unknown table": (
        sweeping(over={"nromal.load": [1.0]}),
        "[nromal]: unknown table, did you mean",
    ),
    "no table in a key": (sweeping(over={"load": [1.0]}), "over.load: expected a table and a key"),
    "empty grid": (
        sweeping(over={"normal.load": []}),
        "over.normal.load: found [], expected a list",
    ),
    "no list": (sweeping(over={"normal.load": 3.0}), "found 3.0, expected a list of values"),
    "no table of keys": (sweeping(over=[1.0]), "[sweep] over: found [1.0], expected a table of"),
    "a wrong value": (
        sweeping(over={"normal.load": [1e-7, -1.0]}),
        "[sweep] over.normal.load[1]: [normal] load: found -1.0, expected a positive number",
    ),
    "a value twice": (sweeping(over={"normal.load": [1e-7, 1e-7]}), "values, none of them twice"),
    "two ways of one key": (
        sweeping(over={"normal.load": [1e-7]}, together={"normal.load": [2e-7]}),
        "over.normal.load: swept twice, in [sweep.together] too",
    ),
    "seed twice": (
        sweeping(seeds=3, over={"asperities.seed": [1], "asperities.height_std": [1e-7]}),
        "swept twice, by seeds too",
    ),
    "fractions swept": (
        sweeping(over={"cycle.maximum_fraction": [[0.1]]}),
        "values of [cycle] are columns",
    ),
    "of unequal length": (
        sweeping(together={"normal.load": [1e-7, 2e-7], "sphere.radius": [1.0]}),
        "together: found [1, 2] values, expected as many of each key",
    ),
    "no seeds": (sweeping(seeds=0), "seeds: found 0, expected how many (1 or more)"),
    "a seed twice": (sweeping(seeds=[1, 1]), "seeds: found [1, 1], expected how many"),
    "nothing random": (sweeping(seeds=3), "seeds: nothing is random"),
    "draws without seeds": (
        sweeping(draw={"sphere.radius": {"uniform": [1, 2]}}),
        "seeds: missing, needed with",
    ),
    "no law": (
        sweeping(seeds=1, draw={"sphere.radius": {"gauss": [1, 2]}}),
        "expected one of: uniform",
    ),
    "wrong order": (
        sweeping(seeds=1, draw={"sphere.radius": {"uniform": [2, 1]}}),
        "uniform = [low, high] with low < high",
    ),
    "a negative mean": (
        sweeping(seeds=1, draw={"sphere.radius": {"lognormal": [-1, 1]}}),
        "lognormal = [mean > 0, coefficient of variation from 0 to 1: not in per cent]",
    ),
    "one number": (
        sweeping(seeds=1, draw={"sphere.radius": {"normal": [1]}}),
        "{'normal': [1]}, expected one of: uniform",
    ),
    "unknown measure": (
        tables(sweep={"measure": ["los"]}),
        'measure: found "los", expected a number of the tables [normal], [cycle]: did you mean '
        '"loss"?',
    ),
    "no measure": (tables(sweep={"measure": []}), "measure: found [], expected a list of numbers"),
    "measure missing": (SMALL | {"sweep": {}}, "[sweep] measure: missing"),
    "no cycle": (
        tables(cycle=None),
        'measure: found "loss", expected a number of the tables [normal]',
    ),
    "no friction": (
        {**tables(cycle=None, friction=None), "sweep": {"measure": ["onset"]}},
        "friction: found none, expected a coefficient",
    ),
}


@pytest.mark.sample(10)
@pytest.mark.parametrize(("contents", "said"), WRONG.values(), ids=WRONG)
def test_mistakes(contents: dict[str, Any], said: str) -> None:
    message = mistakes(contents)
    assert said in message
    assert all(line.startswith("sweep.toml: ") for line in message.splitlines())


def test_all_mistakes_are_told_at_once() -> None:
    wrong = sweeping(seeds=0, over={"load": [1.0], "normal.load": []})
    wrong = {**wrong, "sphere": {"radius": -1}}
    said = mistakes(wrong).splitlines()
    assert [line.split(": ")[1] for line in said] == [
        "[sweep] seeds", "[sweep] over.normal.load", "[sweep] over.load", "[sweep] seeds",
        "[sphere] radius",
    ]  # fmt: skip


@pytest.mark.usefixtures("no_processes")
def test_a_new_scene_takes_a_sweep(command: Any, tmp_path: Path) -> None:
    """It has stages that are not measured: one line names them."""
    command("new", "a.toml")
    text = (tmp_path / "a.toml").read_text()
    over = '"normal.approach" = [8e-6, 1e-5]\n'
    (tmp_path / "a.toml").write_text(f'{text}[sweep]\nmeasure = ["loss"]\n[sweep.over]\n{over}')
    status, out, err = command("sweep", "a.toml", "--workers", "1")
    assert (status, err) == (0, "")
    assert "left out    [shear], [history]: nothing measured\n" in out
    wrong = f"{text}[sweep]\nseeds = 2\n"
    (tmp_path / "a.toml").write_text(wrong)
    assert command("sweep", "a.toml").err.splitlines() == [
        "convexrough: error: a.toml: [sweep] measure: missing, expected a list of numbers of "
        'summary.json, none of them twice, such as ["load"]',
        "convexrough: error: a.toml: [sweep] seeds: nothing is random: expected height_std or "
        "tip_radius_cv in [asperities], or a table [sweep.draw]",
    ]


def test_what_is_wrong_ends_with_status_2(command: Any, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(toml(tables(sweep={"sede": 3})))
    for arguments in (["a.toml"], ["none.toml"], [], ["a.toml", "--part", "3/2"],
                      ["a.toml", "--workers", "0"], ["--summary", "nowhere"],
                      ["a.toml", "--workers", "1", "--scheduler", "local"]):  # fmt: skip
        status, out, err = command("sweep", *arguments)
        assert (status, out) == (2, ""), arguments
        assert "Traceback" not in err
    assert not (tmp_path / "a-sweep").exists()
