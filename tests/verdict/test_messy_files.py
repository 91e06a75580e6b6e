"""Messy files and slips of units: read right, or refused with the cause named."""

import gzip
import json
import re
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import pytest
from scene_files import Columns, cells, claimed, lines, put, scene_text
from scenes import MATERIAL, hexagonal

import convexrough as cr
from convexrough.errors import MistakesError
from convexrough.run.study import UnitsTable

COUNT = 12
RNG = np.random.default_rng(5)
GRID = np.stack(np.meshgrid(np.arange(4) - 1.4, np.arange(3) - 0.8), axis=-1).reshape(-1, 2)
PLACES = 5e-5 * (GRID + RNG.uniform(-0.2, 0.2, GRID.shape))
HEIGHTS = RNG.uniform(-3e-7, 0, COUNT)
XY = {"x": PLACES[:, 0], "y": PLACES[:, 1]}
SUMMITS = XY | {"height": HEIGHTS}
MEANS, SUMS = ({name: np.round([*each, total(each)], 12) for name, each in SUMMITS.items()}
               for total in (np.mean, np.sum))  # fmt: skip
BODIES = """sphere = {youngs_modulus = 210e9, poisson_ratio = 0.3}
base = {youngs_modulus = 70, poisson_ratio = 0.3}"""
STEEL, METRES = "youngs_modulus = 210e9", 'length = "m"\nforce = "N"'


class Case(NamedTuple):
    """A scene, its solution, a shuffled order, and a folder with its files."""

    contact: cr.Contact
    loads: Any
    order: Any
    folder: Path
    command: Any

    def verify(self, made: Any, *options: str, name: str = "loads.csv") -> Any:
        return self.command("verify", "scene.toml", put(self.folder, made, name), *options)

    def read(self, columns: Any) -> cr.SceneFile:
        """The scene, with another table of summits."""
        put(self.folder, columns, "summits.csv")
        return cr.read_scene(self.folder / "scene.toml")

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
def case(tmp_path: Path, command: Any) -> Case:
    """In scene.toml, in metres and newtons, with its summits in summits.csv."""
    write_scene()
    put(tmp_path, SUMMITS, "summits.csv")
    contact = cr.read_scene("scene.toml").press()
    assert 3 < (contact.loads > 0).sum() < COUNT - 3
    order = np.random.default_rng(1).permutation(COUNT)
    return Case(contact, contact.loads, order, tmp_path, command)


def write_scene(modulus: str = STEEL, units: str = METRES) -> None:
    file = 'pattern = "file"\npath = "summits.csv"\ngeometry = "closest"\ntip_radius = 2e-4'
    material = modulus if modulus is BODIES else f"{modulus}\npoisson_ratio = 0.3"
    text = scene_text(file, "approach = 4e-7", f"[units]\n{units}", "0.01", material)
    Path("scene.toml").write_text(text)


def matrix(columns: Columns) -> Any:
    return np.column_stack([np.asarray(each) for each in columns.values()])


def patches(case: Case) -> dict[str, Any]:
    """Four nodes about each asperity that touches, with a quarter of its load each."""
    touched = np.flatnonzero(case.loads)
    corners = 1e-6 * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    points = (case.contact.scene.contact_points[touched][:, None] + corners).reshape(-1, 2)
    return dict(x=points[:, 0], y=points[:, 1], load=np.repeat(case.loads[touched] / 4, 4))


def beside(case: Case) -> dict[str, Any]:
    """The nodes, and a load farther out than an asperity by the distance of its neighbour."""
    places = case.contact.scene.contact_points
    out = places[np.argmax(places[:, 0])]
    apart = np.sort(np.hypot(*(places - out).T))[1]
    more = {"x": out[0] + apart, "y": out[1], "load": 1e-3 * case.loads.max()}
    return {name: [*each, more[name]] for name, each in patches(case).items()}


def fine_and_coarse() -> Any:
    """The pixels on the left, and every third one of every third row on the right."""
    row, column = np.divmod(np.arange(121**2), 121)
    return (column < 60) | ((column % 3 == 0) & (row % 3 == 0))


def tributary(case: Case) -> dict[str, Any]:
    """Nodes of a mesh without order, each with its pressure and its area."""
    nodes = patches(case)
    area = np.random.default_rng(2).uniform(1e-12, 2e-12, len(nodes["x"]))
    return {"x": nodes["x"], "y": nodes["y"], "pressure [Pa]": nodes["load"] / area,
            "area [m²]": area}  # fmt: skip


def german(columns: Columns) -> str:
    return lines(columns, ";", ",")


def shuffled(case: Case, start: int = 0, name: str = "index") -> dict[str, Any]:
    return {name: case.order + start, "load": case.loads[case.order]}


#: What a file holds; its name, if not loads.csv; and the options it is read with, if any.
READ: list[tuple[Any, ...]] = [
    (lambda case: shuffled(case) | {"rank": np.arange(COUNT)[::-1]},),
    (lambda case: german(case.table()), "a.csv.gz"),
    *((lambda case, form=form: {"result": form(case.table())}, "a.mat") for form in (matrix, dict)),
    (lambda case: {"load": case.loads, "more": "a note"}, "a.mat"),  # a row of loads
    (lambda case: [[["# Run 7"], [], *cells(case.table("x\xa0[m] y\xa0[m] load\xa0[N]"))],
                   [["notes"]]], "a.xlsx"),
    (shuffled,),
    (lambda case: {name: each[case.loads[case.order] > 0] for name, each in case.table().items()},
     "a.csv", "--missing-open"),
    (lambda case: matrix(shuffled(case, 1)), "a.npy", "--column index=1 --column load=2"),
    (lambda case: shuffled(case, 0, "place") | {"index": np.arange(COUNT)}, "a.csv",
     "--column index=place"),
    *((lambda case, row=row, name=name: {row: np.arange(COUNT) + 1} | shuffled(case, 1, name),)
      for row, name in (("", "asperity"), ("row", "index"))),  # row numbers before the index
    (lambda case: case.table(load=-case.loads[case.order]), "a.csv", "--sign -1"),
    (lambda case: "% run 7\n" + lines(case.table("x\xa0[m] y\xa0[m] load\xa0[N]")),),
    (lambda case: "# run 7\n" + lines(case.table()), "a.csv",
     "--scale load=1 --scale x=1 --scale y=1"),
    (lambda case: {"F": np.column_stack((case.loads, 0 * case.loads, case.loads))}, "a.mat",
     "--column load=3"),
    (Case.pixels, "a.csv", "--within 1e-9"),
    (lambda case: {name: each[case.pixels()["pressure"] > 0]
                   for name, each in case.pixels().items()}, "a.csv", "--within 1e-9"),
    (lambda case: {name: [*each, 0.0] for name, each in tributary(case).items()},),
    (patches, "a.csv", "--nodes"),
    (lambda case: case.table(Load=2 * case.loads[case.order]), "a.csv", "--column load=load"),
    (lambda case: case.table("x y load\xa0[mN]", **{"load\xa0[mN]": 1e3 * case.loads[case.order]}),
     "a.csv", "--scale load=0.001"),
]  # fmt: skip


#: What a file holds; its name and the options it is read with, or ""; and all that is said.
REFUSED: list[tuple[Any, ...]] = [
    *((lambda case, said=said: f"{said}\n" + lines(case.table()), "",
       f"comments: found {said!r}, expected units in the header, as load [N], or no such comments")
      for said in ("# loads in mN", "% run 7")),
    *((lambda case, more=more: case.table() | more, file,
       f"found {said}, expected columns that need no unit, factor or offset; name a unit as in")
      for more, file, said in (({"unit": np.array("kN")}, "a.npz", "unit"),
                               ({"info": {"factor": 1e-3}}, "a.mat", "info.factor"))),
    (lambda case: lines(case.table() | {"unit": ["kN"] * COUNT}), "",
     "column unit: found 'kN', expected units in the header, as load [N], or no such column"),
    (lambda case: case.table("x y load\xa0[Newtn]"), "", "load: found 'Newtn'", "--scale load=1"),
    (lambda case: case.table("x\xa0[m] y\xa0[mm] load"), "", "column y: found mm, expected m",
     "--scale y=0.001", "convert = true"),
    (lambda case: case.table(x=1e3 * PLACES[case.order, 0], y=1e3 * PLACES[case.order, 1]), "",
     "times as large as", "--scale x=0.001 --scale y=0.001"),
    (lambda case: case.pixels() | {"x": case.pixels()["x"] + 2e-4}, "",
     "all are shifted by about [0.0001997, 9e-08], expected x, y rela"),
    (lambda case: case.table(x=np.round(PLACES[case.order, 0], 5)), "",
     "if they are rounded: --tolerance "),
    (lambda case: {name: [*each, each[0] * 0.0 if "area" in name else each[0]]
                   for name, each in tributary(case).items()}, "",
     "column area: found 0, expected a positive number"),
    (lambda case: case.table(Load=case.loads), "", "'load' and 'Load', expected one of them: --"),
    (beside, "a.csv --nodes", ": found a load at [", "0.9 of that asperity's distance from its"),
    (lambda case: {name: [*each, each[0]] for name, each in
                   ({"node": np.arange(len(patches(case)["x"]))} | patches(case)).items()},
     "a.csv --nodes", "found the same position as in row", "expected each node once"),
    (lambda case: matrix(case.table()).T, "a.npy", "12 columns and 3 rows: transposed?"),
    ("<!DOCTYPE html>\n<html><body>404</body></html>\n", "", "a page in HTML"),
    (Case.table, "a.csv --column x=load", "found 'load' as load and x, expected one each"),
    (lambda case: [[*cells(case.table())[:-1], [0.5, 0.5, "1,257"]]], "a.xlsx",
     "column load: found '1,257', expected a decimal point and no thousands separators"),
    (Case.table, "a.csv --scale load=2 --scale load=1", "--scale: found load twice"),
    (Case.table, "a.csv --scale pressure=3 --scale area=-2",
     "--scale: found area=-2, pressure=3, expected a column that is read"),
    (b"MATLAB 7.3 MAT-file".ljust(128) + b"\x89HDF\r\n", "a.mat", "save(..., '-v7')"),
    (lambda case: [[["load", "E"], [3.0, 70e9]], cells(case.table())], "a.xlsx",
     'rows: found 1 in sheet "Sheet" of 2, expected 12, one per'),
    (lambda case: {"load": np.where(case.loads > 0, -case.loads, 1e-9 * case.loads.max())}, "",
     "and the least is -", "expected positive compression: --sign -1 and --floor "),
    (gzip.compress(b"load\n1\n" * 999)[:40], "a.csv.gz", "ended before"),
    (lambda case: case.table("x y pressure"), "", "'area', or x and y on a regular grid"),
    (lambda case: {name: each[fine_and_coarse()] for name, each in case.pixels().items()}, "",
     "expected a column 'area', or x and y on a regular grid: x, y pixels of several sizes"),
    (lambda case: case.pixels("x y CPRESS"), "", "expected a column 'load'; --column load=CPRE",
     "names another, --column pressure=CPRESS that of pixels"),
    (lambda case: lines(case.table()) + f"Sum:,,{case.loads.sum()}\n", "",
     'row 14: found a row of "Sum:", expected none: remove it: Sum:,,'),
    (lambda case: case.table("X1 y load"), "", "found only y, expected x and y; not used: X1"),
    (lambda case: case.pixels("X1 X2 pressure"), "", "found neither x nor y, expected both"),
]  # fmt: skip

#: As above, with a line for each of several mistakes.
REFUSED_ROWS: list[tuple[Any, ...]] = [
    (lambda case: lines(case.table()).replace("load\n", "load\nm,m,N\n", 1), "",
     "row 2, column load: found 'N', expected a finite number; units belong into the header, as "
     "load [N]: m,m,N"),
    (lambda case: "Run 7\n\n" + lines(case.table()), "",
     "columns: found Run 7, expected a column 'load'; remove the lines above the names ",
     "row 3: found 3 cells, expected 1, as in the header: x,y,load"),
    (lambda case: (text := lines(case.table())) + text.splitlines()[3] + "\n", "",
     "rows: found 13, expected 12, one per asperity of the scene\n",
     "row 14: found the same position as in row 4, expected each asperity once"),
    (lambda case: lines(case.table(), ",", ","), "", "row 2: found 6 cells, expected 3, as in the"),
    ("x;y;load\n" + 9 * "0,5;1,5;1.234,5\n", "",
     "row 2, column load: found '1.234,5', expected a decimal comma and no thousands sep"),
    (lambda case: {"index": [0, *range(COUNT - 1)], "load": case.loads}, "",
     "column index: found 0 in row 2 and row 3"),
    (lambda case: lines(shuffled(case)) + ",1.5\n", "", "; --nodes sums rows by asperity",
     "column index: found '' in row 14, expected whole numbers"),
    (lambda case: shuffled(case, 1) | {"asperity": np.arange(COUNT)[::-1]}, "",
     "columns index, asperity: found other asperities in each, expected one ind"),
    ({"index": [3, 4, 5], "load": [1, 2, 3]}, "", "found numbers from 3 to 5, expected either 0,",
     "or 12, if they count from 1: add this row with load 0"),
    (lambda case: shuffled(case, 1, "Knoten"), "", "column Knoten: found", "--column index=Knoten"),
    ({"index": [1e19, 2], "load": [1, 2]}, "", "column index: found 1e+19 in row 2"),
]  # fmt: skip


def test_read_right(case: Case) -> None:
    for make, *where in READ:
        file, options = (*where, *["loads.csv", ""][len(where) :])
        outcome = case.verify(make(case), "--json", *options.split(), name=file)
        assert (outcome.status, outcome.err) == (0, "")
        found = [row["load"] for row in json.loads(outcome.out)["asperities"]]
        np.testing.assert_allclose(found, case.loads, rtol=1e-13)


def test_refused_with_the_cause(case: Case) -> None:
    for refused in (*REFUSED, *REFUSED_ROWS):
        made, read, *causes = refused
        file, *options = (read or "loads.csv").split()
        outcome = case.verify(made(case) if callable(made) else made, *options, name=file)
        assert (outcome.status, outcome.out) == (2, ""), causes
        assert all(cause in outcome.err for cause in causes), outcome.err
        assert len(outcome.err.splitlines()) <= (11 if refused in REFUSED_ROWS else 1)


def test_pressures_at_hexagonal_points(tmp_path: Path) -> None:
    """Each stands for a cell of the hexagonal lattice."""
    scene = hexagonal(spacing=1e-3, within=4e-3)
    x, y = scene.asperities.positions.T
    columns = {"x": x, "y": y, "pressure": np.full(len(x), 2.0)}
    found = claimed(tmp_path, columns, scene=scene)
    np.testing.assert_allclose(found.values, 2.0 * 1e-6 * np.sqrt(0.75), rtol=1e-9)
    assert "each of area 8.6603e-07" in found.note


@pytest.mark.parametrize("height", [-2.5e-3, -2e-4])
def test_pixels_of_a_large_disc_nearer_to_a_small_neighbour(tmp_path: Path, height: float) -> None:
    """The neighbour is open, or its contact is missing in the map."""
    places = [(0.0, 0.0), (0.04, 0.0), (0.1, 0.1), (-0.05, 0.1), (0.1, -0.05), (-0.05, -0.05)]
    asperities = cr.Asperities(places, [2.0, *5 * [0.5]], [0.0, height, *4 * [0.0]])
    scene = cr.Scene(np.inf, asperities, cr.Material.from_youngs(210e3, 0.3))
    contact = cr.press(scene, load=3.0)
    assert contact.contact_radii[0] > 0.02
    assert contact.crowding < 1
    x, y = (each.ravel() for each in np.mgrid[-0.09:0.14:4e-4, -0.09:0.14:4e-4])
    pressure = cr.fields.pressure(contact, np.column_stack((x, y)))
    pressure[np.hypot(x - 0.04, y) < contact.contact_radii[1]] = 0.0
    loads = claimed(tmp_path, {"x": x, "y": y, "pressure": pressure}, scene=scene).values
    verdict = cr.verify(scene, loads, load=3.0, within=0.02)
    assert verdict.wrongly_open.tolist() == ([1] if contact.loads[1] > 0 else [])
    assert len(verdict.wrongly_loaded) == 0
    assert verdict.error < 0.02


def test_nodes_with_loads_in_a_wrong_unit(tmp_path: Path) -> None:
    """Discs that follow from such loads overlap, so nodes belong to the nearest asperities."""
    scene = hexagonal(spacing=1e-3, within=2e-3)
    loads = cr.press(scene, approach=2e-6).loads
    x, y = (scene.asperities.positions[:, None] + [[0.0, 0.0], [5e-5, 0.0]]).reshape(-1, 2).T
    columns = {"x": x, "y": y, "load": np.repeat(loads, 2) / 2 * 1e3}
    found = claimed(tmp_path, columns, scene=scene, nodes=True)
    np.testing.assert_allclose(found.values, loads * 1e3, rtol=1e-6)


def test_a_lattice_moved(tmp_path: Path) -> None:
    """Most rows of the shifted one lie on an asperity, the wrong one."""
    for pattern, moved, cause in (
        (cr.Asperities.square, lambda points: np.add(points, [1e-3, 0]),
         "all are shifted by [0.001, 0], to within 1e-05, expected x, y relative to the sphere's"),
        (cr.Asperities.hexagonal, lambda points: points[:, ::-1],
         "x and y are exchanged: --column x=y --column y=x"),
    ):  # fmt: skip
        asperities = pattern(spacing=1e-3, tip_radius=0.02, within=4e-3)
        x, y = moved(asperities.positions).T
        columns = {"x": x, "y": y, "load": np.ones(len(x))}
        with pytest.raises(MistakesError, match=re.escape(f"loads.csv: positions: {cause}")):
            claimed(tmp_path, columns, scene=cr.Scene(1.0, asperities, MATERIAL))


def on_square() -> cr.Contact:
    """Of the geometry "closest", so that contact points are not the positions of the summits."""
    asperities = cr.Asperities.square(spacing=0.04, tip_radius=0.15, within=0.25)
    return cr.press(cr.Scene(8.0, asperities, MATERIAL, geometry="closest"), approach=8e-4)


def test_positions_of_contact_points(tmp_path: Path) -> None:
    scene, loads = on_square().scene, on_square().loads
    x, y = scene.contact_points.T
    columns = {"x": x[::-1], "y": y[::-1], "load": loads[::-1]}
    found = claimed(tmp_path, columns, scene=scene, tolerance=1e-5)
    np.testing.assert_array_equal(found.values, loads)


def test_headers_of_nodes_at_a_square_lattice(tmp_path: Path) -> None:
    """Loads taken as positions fit by chance, so the header must not be blamed first."""
    scene, loads = on_square().scene, on_square().loads
    touched, angles = np.flatnonzero(loads), np.arange(8) * np.pi / 4
    around = 4e-3 * np.column_stack((np.cos(angles), np.sin(angles)))
    nodes = (scene.contact_points[touched][:, None] + around).reshape(-1, 2)
    shares = np.repeat(115384.6 * loads[touched] / 8, 8)
    scales, shifts = "--scale x=1000 --scale y=1000", "shifted by about [0.02, 0], "
    for moved, said in ((1e-3 * nodes, scales), (np.add(nodes, [0.02, 0]), shifts)):
        columns = {"x": moved[:, 0], "y": moved[:, 1], "load": shares}
        with pytest.raises(MistakesError, match=re.escape(said)):
            claimed(tmp_path, columns, scene=scene, nodes=True)


# Units

UM = {"X (µm)": 1e6 * PLACES[:, 0], "Y (µm)": 1e6 * PLACES[:, 1]}
NM = {"height [nm]": 1e9 * HEIGHTS}
CONVERT = METRES + "\nconvert = true"


def test_advice_where_headers_name_units(case: Case) -> None:
    def placed(*factors: float) -> dict[str, Any]:
        x, y = (PLACES[case.order] * factors).T
        return {"x [mm]": x, "y [mm]": y, "load": case.loads[case.order]}

    write_scene(units=CONVERT)
    said = "10^3 times as large as the scene's, expected the scene's unit of length: correct "
    assert case.verify(placed(1e6, 1e6)).refuses(f"{said}their units in the header")
    mirrored = placed(-1e3, 1e3)
    assert case.verify(mirrored).refuses("x has the other sign: --scale x=-0.001")
    assert case.verify(mirrored, "--scale", "x=-0.001").status == 0


def test_units_convert_when_asked(case: Case) -> None:
    """Of pressures, and of summits."""
    pixels = case.pixels("x y pressure\xa0[MPa]")
    pixels["pressure\xa0[MPa]"] = 1e-6 * pixels["pressure\xa0[MPa]"]
    write_scene(units=CONVERT)
    assert case.verify(pixels).status == 0
    asperities = case.read(german(UM | NM)).scene.asperities
    np.testing.assert_allclose(asperities.positions, PLACES, rtol=1e-15)
    np.testing.assert_allclose(asperities.heights, HEIGHTS, rtol=1e-15)


def test_results_say_their_units(case: Case) -> None:
    """So that a scene in other units does not misread them."""
    table = "scene-results/asperities.csv"
    assert case.command("run", "scene.toml", "--no-figures").status == 0
    said = "x [m],y [m],height [m],tip_radius [m],load [N],contact_radius [m],gap [m],status,"
    assert Path(table).read_text().startswith(said)
    assert case.command("verify", "scene.toml", table).status == 0
    text = Path("scene.toml").read_text()
    text = text.replace("summits.csv", table).replace("tip_radius", "# ")
    Path("a.toml").write_text(text)
    same, own = cr.read_scene("a.toml").scene.asperities, case.contact.scene.asperities
    np.testing.assert_array_equal(same.positions, own.positions)
    Path("a.toml").write_text(text.replace('length = "m"', 'length = "km"'))
    with pytest.raises(cr.InputError, match="column x: found m, expected km, the scene's unit"):
        cr.read_scene("a.toml")


def test_wrong_columns_of_summits(case: Case) -> None:
    for columns, units, said in (
        (XY | NM, METRES, "column height: found nm, expected m, the scene's unit; 1 nm is 1e-09 m"),
        ({"x [m]": XY["x"], "y [N]": XY["y"]}, METRES, "found N, a unit of force"),
        (UM | {"height": HEIGHTS}, CONVERT, "column height: found no unit, expected one, as x"),
        (XY | {"z": HEIGHTS, "h": HEIGHTS}, METRES, "found 'z' and 'h', expected one of them"),
        (UM | NM, "", "column height: found nm, expected µm, as x"),
        (XY | {"id": np.roll(np.arange(COUNT), 1)}, METRES, "column id: found "),
        (MEANS, METRES, "row 14: found the means of the other rows, expected an"),
        (SUMS, METRES, "row 14: found the sums of the other rows, expected an"),
        (XY | {"mean_pressure": HEIGHTS, "rise": HEIGHTS}, METRES, "columns: found rise, but no"),
    ):
        write_scene(units=units)
        with pytest.raises(cr.InputError, match=re.escape(said)) as refused:
            case.read(columns)
        assert ("convert = true" in str(refused.value)) == ("the scene's unit;" in said)


@pytest.mark.parametrize("named", ["", 'height = "z"', 'height = "Z"', 'z = "height"'])
def test_summits_by_other_names(case: Case, named: str) -> None:
    path = case.folder / "scene.toml"
    path.write_text(path.read_text().replace("path =", f"columns = {{ {named} }}\npath ="))
    heights = case.read(XY | {"z": HEIGHTS}).scene.asperities.heights
    np.testing.assert_array_equal(heights, HEIGHTS)


@pytest.mark.parametrize("units", ["m N Pa", "mm N MPa", "µm mN GPa", "µm µN MPa", "in lbf psi"])
def test_a_pressure_implies_the_unit_of_force(units: str) -> None:
    length, force, pressure = units.split()
    assert UnitsTable(length=length, pressure=pressure).names.force == force


def test_units_of_scenes(case: Case) -> None:
    for modulus, units, said in (
        ("youngs_modulus = 210", METRES, "found 210 N/m², which is 210 Pa, expected"),
        (f"{STEEL}\nhardness = 2e15", METRES, "[material] hardness: found 2e+15 N/m², which is 2e"),
        (BODIES, METRES, "[material.base] youngs_modulus: found 70 N/m², which is 70 Pa, expected"),
        ("youngs_modulus = 210", 'length = "um"\nforce = "N"\npressure = "GPa"',
         "found N, expected mN, the force of GPa and um"),
        (STEEL, 'length = "MM"\nforce = "N"', 'expected a unit of length; did you mean "mm"?'),
        (STEEL, 'length = "N"', "length: found N, a unit of force, expected a unit of length"),
        ("E = 210e9", METRES, 'E: unknown key, did you mean "youngs_modulus"?'),
    ):  # fmt: skip
        write_scene(modulus, units)
        assert case.command("run", "scene.toml", "--no-figures").refuses(said)


def test_the_modulus_is_said(case: Case) -> None:
    write_scene("youngs_modulus = 210", 'length = "um"\npressure = "GPa"')
    outcome = case.command("run", "scene.toml", "--no-figures")
    assert "contact modulus   115.3846154 mN/um²  (1.154e+11 Pa)" in outcome.out
    assert " mN/um²  (no hardness given: yield is not checked)" in outcome.out
    assert " mN\n" in outcome.out


def test_what_is_unlikely_is_told(case: Case) -> None:
    few = "the coefficient of friction is 30: few pairs of bodies exceed 2; it is"
    for modulus, more, said in (
        ("210e3", "", r" Pa\): softer than rubber"),
        ("5e12", "", r" Pa\): above"),
        ("210e9", "\n[friction]\ncoefficient = 30", few),
    ):
        write_scene(f"youngs_modulus = {modulus}", METRES + more)
        outcome = case.command("run", "scene.toml", "--no-figures", "--force")
        assert outcome.status == 0
        assert re.search(said, outcome.err)


# What else is read, and said


def test_explain_reads_and_judges_nothing(case: Case) -> None:
    table = german(case.table("x\xa0[m] y\xa0[m] P", gap=case.loads))
    asked = ("--explain", "--column", "load=P")
    outcome = case.verify(table, *asked)
    assert (outcome.status, outcome.err) == (0, "")
    for said in ("separated by semicolons, decimal comma", "x: column x in m", "load: column P",
                 "matched by position", "not looked at: gap", "closest"):  # fmt: skip
        assert said in outcome.out
    assert "certificate" not in outcome.out
    shown = case.verify(table, *asked, "--json")
    assert json.loads(shown.out)["read"] == outcome.out.removesuffix("\n").split("\n")
    assert case.verify(table, *asked, "--junit", "a.xml").refuses("--explain checks nothing")


def test_loads_beside_pressures(case: Case) -> None:
    outcome = case.verify(case.table(**{"pressure [Pa]": np.ones(COUNT)}))
    assert (outcome.status, outcome.err) == (0, "")
    assert "loads.csv: separated by commas, column load, not pressure, matched" in outcome.out


def test_findings_as_junit(case: Case) -> None:
    wrong = case.loads.copy()
    wrong[np.argmax(wrong)] = 0.0
    assert case.verify({"load": wrong}, "--junit", "a.xml").status == 3
    (suite,) = ElementTree.parse("a.xml").getroot().iter("testsuite")
    cases = {each.get("name"): each for each in suite}
    assert list(cases) == ["loads: contact set", "loads: undecided", "loads: off", "loads: total"]
    assert suite.get("failures") == str(sum(len(each) for each in cases.values()))
    assert f"{np.argmax(case.loads)} at (" in str(cases["loads: contact set"][0].text)
    assert str(cases["loads: off"][0].get("message")).startswith("loads: off: at most ")
    again = case.verify({"load": case.loads[1:]}, "--junit", "a.xml")
    assert again.refuses("a.xml: exists already")
    for name, option in (("c.xml", "--junit c.xml"), ("proof.json", "--proof")):  # an input stays
        kept = lines({"load": case.loads})
        outcome = case.verify(kept, *option.split(), "--force", name=name)
        assert outcome.refuses(f"{name}: an input; name another file")
        assert Path(name).read_text() == kept
    Path("q.xml").write_text("force\n0\n")
    options = "--shear=q.xml", "--shear-force", "0", "--junit", "q.xml", "--force"
    assert case.verify({"load": case.loads}, *options).refuses("q.xml: an input")
    assert Path("q.xml").read_text() == "force\n0\n"
    outcome = case.verify({"load": case.loads}, "--junit", "summits.csv", "--force")
    assert outcome.refuses("--junit summits.csv: expected a name that ends in .xml")
    assert Path("summits.csv").exists()


def test_bytes_of_every_kind_end_in_a_reason(case: Case) -> None:
    whole = case.folder / put(case.folder, {"load": case.loads}, "whole.mat")
    for name in ("a.mat", "a.xlsx", "a.csv.gz"):
        for content in (b"", b"\x00" * 200, whole.read_bytes()[:150], b"PK\x03\x04" + b"x" * 99):
            assert case.verify(content, name=name).refuses(f"{name}: ")
