"""Which scenes a sweep has, in which order, and what a file may say of them."""

import itertools
import math
from pathlib import Path
from typing import Any

import pytest
from sweep_files import SMALL, sweeping, tables

import convexrough as cr
from convexrough.sweeps.grid import Grid, with_values
from convexrough.sweeps.plan import plan_of


def identity(contents: dict[str, Any], folder: Path = Path()) -> Any:
    """The hash of a sweep."""
    return plan_of(contents, folder / "sweep.toml").manifest["sweep"]


def mistakes(contents: dict[str, Any]) -> str:
    with pytest.raises(cr.InputError) as caught:
        identity(contents)
    return str(caught.value)


def grid(**keys: Any) -> Grid:
    return Grid(measure=["load"], **keys)


def test_rows_are_in_the_order_of_lists_then_grid_then_seeds() -> None:
    together = {"sphere.radius": [1.0, 2.0], "material.poisson_ratio": [0.1, 0.2]}
    over = {"normal.load": [1, 2, 3], "asperities.height_std": [0.0, 1.0]}
    mine = grid(together=together, over=over, seeds=[7, 5])
    assert mine.count == 2 * 3 * 2 * 2
    found = [mine.point(i) for i in range(mine.count)]
    expected = itertools.product([(1.0, 0.1), (2.0, 0.2)], (1, 2, 3), (0.0, 1.0), (7, 5))
    for (values, seed), (both, load, height, own) in zip(found, expected, strict=True):
        assert (*values.values(), seed) == (*both, load, height, own)


def test_draws_belong_to_the_seed_alone() -> None:
    def samples(**draw: Any) -> list[float]:
        mine = grid(over={"normal.load": [1, 2]}, draw=draw, seeds=5)
        return [mine.point(i)[0]["friction.coefficient"] for i in range(mine.count)]

    friction = {"friction.coefficient": {"uniform": [0.2, 0.6]}}
    alone = samples(**friction)
    assert alone[:5] == alone[5:]
    assert len(set(alone)) == 5
    assert all(0.2 <= value <= 0.6 for value in alone)
    assert samples(**{"sphere.radius": {"normal": [1.0, 0.1]}}, **friction) == alone


def test_whatever_numbers_depend_on_is_in_the_hash(tmp_path: Path) -> None:
    """Also the contents of a file of asperities."""
    over = {"normal.load": [1e-7, 3e-7], "asperities.height_std": [0.0, 1e-6]}
    found = [
        identity(SMALL),
        identity(tables(sphere={"radius": 1.1})),
        identity(sweeping(seeds=2, draw={"sphere.radius": {"uniform": [1, 2]}})),  # no heights
        identity(tables(cycle={"maximum_fraction": [0.38]})),
        *(identity(tables(sweep={"seeds": seeds})) for seeds in (5, [0, 1, 2, 4])),
        *(identity(tables(sweep=table)) for table in ({"measure": ["load"]}, {"over": over})),
    ]
    contents = sweeping(over={"normal.load": [1e-7]})
    contents["asperities"] = {"pattern": "file", "path": "a.csv"}
    for x in (0.0, 1e-4):
        (tmp_path / "a.csv").write_text(f"x,y,tip_radius\n{x},0.0,0.02\n")
        found.append(identity(contents, tmp_path))
    assert len({*found}) == len(found)


def test_a_key_of_a_table_within_a_table() -> None:
    own = {"material": {"sphere": {"youngs_modulus": 1.0, "poisson_ratio": 0.3}, "base": {}}}
    for modulus in (2.0, 3.0):
        there = with_values(own, {"material.sphere.youngs_modulus": modulus}, None)["material"]
        assert there == {"sphere": {"youngs_modulus": modulus, "poisson_ratio": 0.3}, "base": {}}
    assert own["material"]["sphere"]["youngs_modulus"] == 1.0


def test_a_table_with_its_own_loads_is_named() -> None:
    path = {"loads": [3e-7, 2e-7], "forces": [1e-8, 0.0]}
    for swept, own in (("normal.load", ["path"]), ("sphere.radius", [])):
        sweep = {"measure": ["path.loss"], "over": {swept: [1.0, 2.0]}}
        plan = plan_of({**tables(path=path), "sweep": sweep}, Path("sweep.toml"))
        assert plan.manifest["own_loads"] == own


def test_values_of_together_are_checked_together() -> None:
    """Also where each of them is wrong beside the others of the first scene."""

    def paths(last: list[float]) -> dict[str, Any]:
        both = {"path.loads": [[3e-7], [3e-7] * 3], "path.forces": [[0.0], last]}
        found = sweeping(together=both, measure=["path.loss"])
        return found | {"path": {"loads": [1e-7], "forces": [0.0]}}

    assert plan_of(paths([0.0] * 3)).source.count == 2
    places = "[sweep] together.path.loads[1], together.path.forces[1]"
    assert f"{places}: [path] loads, forces: found 3 and 2 values" in mistakes(paths([0.0] * 2))
    places = "sweep.toml: [sweep] together.path.forces[1]"
    assert mistakes(paths([math.nan])).startswith(f"{places}: [path] forces[0]: found nan")


ROUGH = {**SMALL["asperities"], "height_std": 1e-7}  # seeds are those of the sweep

WRONG = [
    ({k: v for k, v in SMALL.items() if k != "sweep"}, "[sweep]: missing table"),
    (tables(sweep={"sede": 3}), '[sweep] sede: unknown key, did you mean "seeds"?'),
    (sweeping(over={"normal.load": [1e-7, -1.0]}),
     "[sweep] over.normal.load[1]: [normal] load: found -1.0, expected a positive number"),
    (sweeping(over={"sweep.seeds": [1, 2]}), "over.sweep.seeds: expected a key of a"),
    (sweeping(over={"normal.load": [1e-7, 1e-7]}), "values, none of them twice"),
    (sweeping(over={"material.sphere.poisson_ratio": [0.2]}, together={"material.sphere": [1]}),
     "over.material.sphere.poisson_ratio: swept twice, also in [sweep.together] material.sphere"),
    (sweeping(seeds=3, over={"asperities.seed": [1], "asperities.height_std": [1e-7]}),
     "swept twice, also by seeds"),
    (sweeping(over={"cycle.maximum_fraction": [[0.1]]}), "columns are named after [cycle]"),
    (sweeping(together={"normal.load": [1e-7, 2e-7], "sphere.radius": [1.0]}),
     "together: found [1, 2] values, expected as many for every key"),
    (sweeping(seeds=3), "seeds: nothing is random"),
    (sweeping(seeds=3, over={"asperities.heigth_std": [1e-7]}),
     '[sweep] over.asperities.heigth_std[0]: [asperities] heigth_std: unknown key, did you mean'),
    (sweeping(seeds=1, draw={"sphere.radius": {"uniform": [2, 1]}}),
     "uniform = [low, high] with low < high"),
    (tables(sweep={"measure": ["los"]}), 'measure: found "los", expected a number of the tables '
     '[normal], [cycle]: did you mean "loss"?'),
    ({**tables(cycle=None, friction=None), "sweep": {"measure": ["onset"]}},
     "friction: found none, expected a coefficient"),
]  # fmt: skip


@pytest.mark.sample(10)
@pytest.mark.parametrize(("contents", "said"), WRONG)
def test_mistakes(contents: dict[str, Any], said: str) -> None:
    message = mistakes(contents)
    assert said in message
    assert all(line.startswith("sweep.toml: ") for line in message.splitlines())


def test_all_mistakes_are_told_at_once() -> None:
    wrong = sweeping(seeds=0, over={"load": [1.0], "normal.load": []})
    wrong = {**wrong, "sphere": {"radius": -1}, "asperities": ROUGH}
    said = mistakes(wrong).splitlines()
    assert [line.split(": ")[1] for line in said] == [
        "[sweep] seeds", "[sweep] over.normal.load", "[sweep] over.load", "[sphere] radius",
    ]  # fmt: skip
