"""Messy files and slips of units: read right, or refused with the cause named."""

import gzip
import io
import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.io import savemat

import convexrough as cr

COUNT = 12
RNG = np.random.default_rng(5)
GRID = np.stack(np.meshgrid(np.arange(4) - 1.4, np.arange(3) - 0.8), axis=-1).reshape(-1, 2)
PLACES = 5e-5 * (GRID + RNG.uniform(-0.2, 0.2, GRID.shape))
HEIGHTS = RNG.uniform(-3e-7, 0, COUNT)
SCENE = """
[sphere]
radius = 0.01
[material]
{modulus}
poisson_ratio = 0.3
[asperities]
pattern = "file"
path = "{summits}"
geometry = "closest"
tip_radius = 2e-4
[normal]
approach = 4e-7
[units]
{units}
"""
BODIES = """sphere = {youngs_modulus = 210e9, poisson_ratio = 0.3}
base = {youngs_modulus = 70, poisson_ratio = 0.3}"""
STEEL, METRES = "youngs_modulus = 210e9", 'length = "m"\nforce = "N"'
Columns = Mapping[str, Iterable[Any]]


def lines(columns: Columns, separator: str = ",", decimal: str = ".", header: bool = True) -> str:
    """A table of text, as any program writes it."""
    names, *cells = rows(columns)
    written = [[str(cell).replace(".", decimal) for cell in row] for row in cells]
    return "".join(separator.join(row) + "\n" for row in [*([names] if header else []), *written])


def rows(columns: Columns) -> list[list[Any]]:
    cells = zip(*(np.asarray(each).tolist() for each in columns.values()), strict=True)
    return [list(columns), *map(list, cells)]


def put(folder: Path, made: Any, name: str = "loads.csv") -> str:
    """Write columns, an array, sheets of rows, text, or bytes, as the name of the file says."""
    path, kind = folder / name, name.rpartition(".")[2]
    if isinstance(made, bytes):
        path.write_bytes(made)
    elif kind == "mat":
        savemat(path, made)
    elif kind == "xlsx":
        book = pytest.importorskip("openpyxl").Workbook()
        book.remove(book.active)
        for sheet in made:
            page = book.create_sheet()
            for row in sheet:
                page.append(row)
        book.save(path)
    else:
        content = (made if isinstance(made, str) else lines(made)).encode()
        path.write_bytes(gzip.compress(content) if kind == "gz" else content)
    return name


class Case(NamedTuple):
    """A scene, what it was solved for, and its table of x, y and load in a shuffled order."""

    contact: cr.Contact
    order: Any

    @property
    def loads(self) -> Any:
        return self.contact.loads

    def table(self, names: str = "x y load", **more: Any) -> dict[str, Any]:
        x, y, load = names.split(" ")
        points, loads = PLACES[self.order], self.loads[self.order]
        return {x: points[:, 0], y: points[:, 1], load: loads} | more

    def pixels(self, names: str = "x y pressure") -> dict[str, Any]:
        """Uniform pressure over a square of nine pixels at each asperity, on one grid."""
        step = 2e-6
        nearest = step * np.rint(self.contact.scene.contact_points / step)
        x, y = (step * np.arange(-60, 61) for _ in range(2))
        grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        pressure = np.zeros(len(grid))
        for place, load in zip(nearest, self.loads, strict=True):
            pressure[np.abs(grid - place).max(axis=1) < 1.5 * step] += load / 9 / step**2
        return dict(zip(names.split(" "), (*grid.T, pressure), strict=True))


@pytest.fixture
def case(tmp_path: Path) -> Case:
    """In scene.toml, in metres and newtons, with its summits in summits.csv."""
    write_scene(tmp_path)
    table = {"x": PLACES[:, 0], "y": PLACES[:, 1], "height": HEIGHTS}
    (tmp_path / "summits.csv").write_text(lines(table))
    file = cr.read_scene(tmp_path / "scene.toml")
    contact = cr.press(file.scene, approach=file.approach)
    assert 3 < (contact.loads > 0).sum() < COUNT - 3
    return Case(contact, np.random.default_rng(1).permutation(COUNT))


def write_scene(
    folder: Path, modulus: str = STEEL, units: str = METRES, summits: str = "summits.csv"
) -> None:
    text = SCENE.format(modulus=modulus, units=units, summits=summits)
    (folder / "scene.toml").write_text(text)


def matrix(columns: Columns) -> Any:
    return np.column_stack([np.asarray(each) for each in columns.values()])


def touching(case: Case, columns: Columns) -> dict[str, Any]:
    """Rows of loaded nodes only."""
    chosen = case.loads[case.order] > 0
    return {name: np.asarray(each)[chosen] for name, each in columns.items()}


def patches(case: Case) -> dict[str, Any]:
    """Four nodes about each asperity that touches, with a quarter of its load each."""
    touched = np.flatnonzero(case.loads)
    corners = 1e-6 * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    points = (case.contact.scene.contact_points[touched][:, None] + corners).reshape(-1, 2)
    return dict(x=points[:, 0], y=points[:, 1], load=np.repeat(case.loads[touched] / 4, 4))


RULE = "-" * 60 + "\n"


def abaqus(case: Case) -> str:
    """A report of fields."""
    title = "*** \nField Output Report, written Mon May  4\n\nSource 1\n---------\n\n"
    title += 'Output sorted by column "Node Label".\n\n  Node Label      x       y      load\n'
    columns = {"node": 1 + case.order, **case.table()}
    below = "          @Loc 1  @Loc 1  @Loc 1\n"
    return title + below + RULE + lines(columns, "  ", header=False)


def german(columns: Columns) -> str:
    return lines(columns, ";", ",")


#: What a file holds; its name, if not loads.csv; and the options it is read with, if any.
READ: dict[str, tuple[Any, ...]] = {
    "totals of Abaqus": (
        lambda case: abaqus(case) + f"\n   Total  0  0  {case.loads.sum()}\n", "a.rpt"),
    "gzip of German": (lambda case: german(case.table()), "a.csv.gz"),
    "MATLAB's matrix": (lambda case: {"result": matrix(case.table())}, "a.mat"),
    "workbook with a title": (lambda case: [
        [["Run 7"], [], *rows(case.table("x\xa0[m] y\xa0[m] load\xa0[N]"))]], "a.xlsx"),
    "loaded nodes by place": (
        lambda case: touching(case, case.table()), "a.csv", "--missing-open"),
    "compression is negative": (
        lambda case: case.table(load=-case.loads[case.order]), "a.csv", "--sign -1"),
    "pixels of a map": (Case.pixels, "a.csv", "--within 1e-9"),
    "nodal forces": (patches, "a.csv", "--nodes"),
}  # fmt: skip


def headed(header: str, scale: float = 1.0) -> Callable[[Case], Columns]:
    """A table with another header, and places in another unit."""

    def made(case: Case) -> Columns:
        x, y, _ = header.split(" ")
        table = case.table(header)
        return table | {x: scale * table[x], y: scale * table[y]}

    return made


#: What a file holds; its name and the options it is read with, or ""; and all that is said.
REFUSED: dict[str, tuple[Any, ...]] = {
    "x in mm": (headed("x\xa0[mm] y\xa0[mm] load"), "",
                "column x: found mm, expected m", "--scale x=0.001"),
    "x and y exchanged": (lambda case: case.table("y x load"), "",
                          "x and y are exchanged, or the array is turned: --column x=y --c"),
    "decimal commas between commas": (
        lambda case: lines(case.table(), ",", ","), "", "rows: found up to 6 parts between commas",
        "write decimal points, or semicolons"),
    "x mirrored": (lambda case: case.table(x=-PLACES[case.order, 0]), "",
                   "x has the other sign: --scale x=-1"),
    "negative loads": (lambda case: case.table(load=-case.loads[case.order]), "",
                       "no load is positive, expected compression to be: --sign -1"),
    "a row of totals": (lambda case: lines(case.table()) + f"Sum:,,{case.loads.sum()}\n", "",
                        'row 14: found a row of "Sum:", expected none: remove it: Sum:,,'),
}  # fmt: skip


#: One cause is all there is to say.
MOVED = ("x and y exchanged", "x mirrored")


@pytest.mark.sample(8)
@pytest.mark.parametrize("name", READ)
def test_read_right(tmp_path: Path, command: Any, case: Case, name: str) -> None:
    make, *where = READ[name]
    file, options = (*where, *["loads.csv", ""][len(where) :])
    claimed = put(tmp_path, make(case), file)
    outcome = command("verify", "scene.toml", claimed, "--json", *options.split())
    assert (outcome.status, outcome.err) == (0, "")
    found = [row["load"] for row in json.loads(outcome.out)["asperities"]]
    np.testing.assert_allclose(found, case.loads, rtol=1e-13)


@pytest.mark.sample(8)
@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_the_cause(tmp_path: Path, command: Any, case: Case, name: str) -> None:
    make, read, *causes = REFUSED[name]
    file, *options = (read or "loads.csv").split()
    outcome = command("verify", "scene.toml", put(tmp_path, make(case), file), *options)
    assert (outcome.status, outcome.out) == (2, "")
    assert all(cause in outcome.err for cause in causes), outcome.err
    assert len(outcome.err.splitlines()) <= (1 if name in MOVED else 11)


# Units

UM = {"X (µm)": 1e6 * PLACES[:, 0], "Y (µm)": 1e6 * PLACES[:, 1]}


def test_units_of_a_pressure(tmp_path: Path, command: Any, case: Case) -> None:
    pixels = case.pixels("x y pressure\xa0[MPa]")
    pixels["pressure\xa0[MPa]"] = 1e-6 * pixels["pressure\xa0[MPa]"]
    write_scene(tmp_path, units=METRES + "\nconvert = true")
    assert command("verify", "scene.toml", put(tmp_path, pixels)).status == 0


def test_units_of_summits_are_converted_when_asked_only(tmp_path: Path, case: Case) -> None:
    (tmp_path / "summits.csv").write_text(lines({**UM, "height [nm]": 1e9 * HEIGHTS}, ";", ","))
    with pytest.raises(cr.InputError, match="column x: found µm, expected m, the scene's unit"):
        cr.read_scene(tmp_path / "scene.toml")
    write_scene(tmp_path, units=METRES + "\nconvert = true")
    scene = cr.read_scene(tmp_path / "scene.toml").scene
    np.testing.assert_allclose(scene.asperities.positions, PLACES, rtol=1e-15)
    np.testing.assert_allclose(scene.asperities.heights, HEIGHTS, rtol=1e-15)
    (tmp_path / "summits.csv").write_text(lines({**UM, "height": HEIGHTS}))
    with pytest.raises(cr.InputError, match="column height: found no unit, expected one, as x"):
        cr.read_scene(tmp_path / "scene.toml")


@pytest.mark.parametrize(
    ("modulus", "units", "said"),
    [
        ("youngs_modulus = 210", METRES, "found 210 N/m², which is 210 Pa, expected"),
        ("youngs_modulus = 210e9", 'length = "mm"\nforce = "N"', "which is 2.1e+17 Pa, expected"),
        (BODIES, METRES, "[material.base] youngs_modulus: found 70 N/m², which is 70 Pa, expected"),
        (STEEL, 'length = "MM"\nforce = "N"', 'expected a unit of length; did you mean "mm"?'),
        (STEEL, 'length = "m"\nconvert = true\nforce = "furlong"', "force: found 'furlong'"),
    ],
)
def test_units_of_scenes(
    tmp_path: Path, command: Any, case: Case, modulus: str, units: str, said: str
) -> None:
    write_scene(tmp_path, modulus, units)
    if modulus is BODIES:
        path = tmp_path / "scene.toml"
        path.write_text(path.read_text().replace("poisson_ratio = 0.3\n[asp", "[asp"))
    outcome = command("run", "scene.toml", "--no-figures")
    assert (outcome.status, outcome.out) == (2, "")
    assert said in outcome.err


# What else is read, and said


def test_bytes_of_every_kind_end_in_a_reason(tmp_path: Path, command: Any, case: Case) -> None:
    held = io.BytesIO()
    savemat(held, {"load": case.loads})
    for name in ("a.mat", "a.xlsx", "a.csv.gz"):
        for content in (b"", b"\x00" * 200, held.getvalue()[:150], b"PK\x03\x04" + b"x" * 99):
            outcome = command("verify", "scene.toml", put(tmp_path, content, name))
            assert (outcome.status, outcome.out) == (2, "")
            assert f"{name}: " in outcome.err


def test_findings_as_junit(tmp_path: Path, command: Any, case: Case) -> None:
    from xml.etree import ElementTree

    wrong = np.where(case.loads == case.loads.max(), 0.0, case.loads)
    for loads, status, counts in ((wrong, 3, ("4", "0")), (wrong[1:], 2, ("1", "1"))):
        name = put(tmp_path, {"load": loads})
        outcome = command("verify", "scene.toml", name, "--junit", f"{status}.xml")
        assert outcome.status == status
        (suite,) = ElementTree.parse(tmp_path / f"{status}.xml").getroot().iter("testsuite")
        assert (suite.get("tests"), suite.get("errors")) == counts
        assert suite.get("failures") == str(sum(len(each) for each in suite) - int(counts[1]))
    again = command("verify", "scene.toml", name, "--junit", "2.xml")
    assert (again.status, "2.xml: exists already" in again.err) == (2, True)
