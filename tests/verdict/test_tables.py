"""Tables as people have them: read where the meaning is certain, else every mistake is shown."""

import re
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_files import claimed, put, refusal, scene_text
from scenes import rough

import convexrough as cr
from convexrough.run.asperity_file import read_summits
from convexrough.tabular.roles import Reading
from convexrough.tabular.units import UnitNames
from convexrough.verdict.claims import Manner, read_forces

PLACES = [[0.0, 0.0], [1.0, 0.0], [0.5, 2.5]]
LOADS = [1.5, 0.0, 2.5e-5]


SMALL = cr.Scene(1.0, cr.Asperities(PLACES, 0.1), cr.Material(1.0, 0.3), geometry="summit")
read = partial(claimed, scene=SMALL)


def refused(folder: Path, content: str | bytes) -> list[str]:
    return refusal(lambda _: read(folder, content), folder / "loads.csv")


ROWS = "0,0,1.5\n1,0,0\n0.5,2.5,2.5e-5\n"
GERMAN = "x;y;load [N]\n0;0;1,5\n1;0;0\n0,5;2,5;2,5E-05\n"
FILES = {
    "decimal comma": GERMAN,
    "spaces and a unit": "x [m] y [m] load [N]\n" + ROWS.replace(",", " "),
    "comments": "# made by hand\n% on Monday\nx [m],y [m],load [N]\n" + ROWS,
    "header in a comment": "# x y load\n" + ROWS.replace(",", " "),
    "more columns": "id,x,status,y,load,gap\n7,0,ok,0,1.5,\n8,1,ok,0,0,1\n9,0.5,no,2.5,2.5e-5,\n",
    "pandas": ",x,y,load\n0,0,0,1.5\n1,1,0,0\n2,0.5,2.5,2.5e-5\n",
    "a header in a comment, with units": "# x [m], y [m], load [N]\n" + ROWS.replace(",", " "),
    "separators at the ends of rows": "x,y,load\n" + ROWS.replace("\n", ",,\n"),
    "Fortran": "x,y,load\n0.0D+00,0,0.15D+01\n1,0,0.D0\n0.5,2.5,2.5d-5\n",
    "Fortran, three digits": "x,y,load\n0,0,1.5\n1,0,0\n5.0-001,2.5,2.5-005\n",
    "Windows": ("x,y,load\n" + ROWS).replace("\n", "\r\n"),
    "Excel": "sep=;\n" + GERMAN,
    "byte-order mark": "\ufeffx,y,load\n" + ROWS,
    "UTF-16 without a mark": ("x,y,load\n" + ROWS).encode("utf-16-le"),
    "Latin-1": ("H\xf6he [\xb5m],x,y,load\n1," + ROWS[:-1].replace("\n", "\n1,")).encode("latin-1"),
    "typographic minus": "x,y,load\n0,0,1.5\n1,\N{MINUS SIGN}0,0\n0.5,2.5,2.5e\N{MINUS SIGN}5\n",
    "one column, decimal comma": "load\n1,5\n0\n2,5e-5\n",
    "numbers alone": "1.5\n0\n2.5e-5\n",
    "words first, between spaces": "site x y load\n7 0 0 1.5\nNA 1 0 0\nmid 0.5 2.5 2.5e-5\n",
}


def test_as_people_have_them(tmp_path: Path) -> None:
    for name, content in FILES.items():
        assert read(tmp_path, content).values.tolist() == LOADS, name


def test_unknown_statuses_are_named(tmp_path: Path) -> None:
    """The loads decide; a user sees what her code calls what."""
    for words, said in (
        ("CCO", "column status not compared (C or O with a load, C without)"),
        (("contact", "open", "touches"), "(touches with a load, nothing without)"),
        (("Closed", "OPEN", "undecided"), ""),
    ):
        found = read(tmp_path, {"load": LOADS, "status": list(words)})
        assert said in found.note
        assert any(said in line for line in found.explained)
        assert ("not compared" in found.note) == bool(said)


def test_heights_and_radii_of_another_scene_are_told(tmp_path: Path) -> None:
    """A unit is not converted here: such a column is not compared."""
    for column, values, same in (
        ("height", (0, 0, 1e-9), False),
        ("tip_radius [m]", (0.1, 0.2, 0.1), True),
        ("Tip_radius", (0.1, 0.2, 0.1), False),
        ("tip_radius", (0.1, 0.1004, 0.1), True),
    ):
        found = read(tmp_path, {"load": LOADS, column: values})
        said = f"column {column.lower()} differs from the scene's: loads of another scene?"
        assert (said in found.note) == (not same)


def test_a_line_of_numbers(tmp_path: Path) -> None:
    """As MATLAB writes a row vector."""
    row = cr.Asperities([[i, 0] for i in range(5)], 0.1)
    scene = cr.Scene(1.0, row, cr.Material(1.0, 0.3), geometry="summit")
    for name, made in (("a.csv", "1,2,3,4,5.5\n"), ("a.npy", [[1, 2, 3, 4, 5.5]])):
        assert read(tmp_path, made, name, scene=scene).values.tolist() == [1, 2, 3, 4, 5.5]
    assert read(tmp_path, "1.5,0,2.5e-5\n").values.tolist() == LOADS
    few = replace(SMALL, asperities=cr.Asperities(PLACES[:2], 0.1))
    assert read(tmp_path, "0.25,0.5\n", scene=few).values.tolist() == [0.25, 0.5]
    assert read(tmp_path, "1,0,3\n", missing_open=True).values.tolist() == [0.0, 3.0, 0.0]


def test_columns_without_names_that_are_ignored_are_named(tmp_path: Path) -> None:
    for other in ("0,9,9", "0,inf,nan"):  # also numbers that are no positions
        made = f"{other},1.5\n0,9,9,0\n0,9,9,2.5e-5\n"
        found = read(tmp_path, made, columns={"load": "4"})
        assert found.values.tolist() == LOADS
        assert "in the scene's order (not used: column 1, column 2, column 3)" in found.note


def test_arrays(tmp_path: Path) -> None:
    table = np.column_stack((PLACES, LOADS))
    columns = {"x": table[:, 0], "y": table[:, 1], "load": LOADS, "more": ["a", "b", "c"]}
    alone = {"force": 3.0, "grid": np.eye(4), "load": LOADS, "other": np.ones(9)}
    for made in (LOADS, table, np.rec.fromarrays(table.T, names="x,y,load")):
        assert read(tmp_path, made, "a.npy").values.tolist() == LOADS
    for made in ({"arr_0": LOADS}, columns, alone):
        assert read(tmp_path, made, "a.npz").values.tolist() == LOADS


def test_arrays_of_two_dimensions(tmp_path: Path) -> None:
    """Pixels as a mesh of x, y and pressure; one alone has no known order."""
    x, y = np.meshgrid(np.linspace(-0.1, 1.1, 13), np.linspace(-0.1, 2.6, 28))
    pressure = np.where(np.hypot(x - 0.5, y - 2.5) < 0.15, 2.0, 0.0)
    pressure[1, 1] = 1.0
    area = 0.1 * 0.1
    found = read(tmp_path, {"x": x, "y": y, "pressure": pressure}, "a.npz").values
    assert found == pytest.approx(area * np.array([1.0, 0.0, pressure.sum() - 1.0]))
    lone, axes = {"load": pressure}, {"y": y[:, 0], "x": x[0], "pressure": pressure}
    for made, said in (
        (lone, "found load, expected vectors or matrices of one shape by name, or only one ma"),
        (axes, "found 28 numbers in y, 13 numbers in x, expected as many in each"),
    ):
        with pytest.raises(cr.FileError, match=said):
            read(tmp_path, made, "b.npz")


def test_text_in_arrays_that_is_none(tmp_path: Path) -> None:
    """Characters beyond the last one of Unicode, as in a corrupted file."""
    np.save(tmp_path / "a.npy", np.array(["1.5", "0", "2"]).view("u4") * 2**24 + 1)
    numbers = (tmp_path / "a.npy").read_bytes()
    contents = numbers.replace(b"'<u4'", b"'<U3'").replace(b"(9,)", b"(3,)")
    with pytest.raises(cr.FileError, match=r"not an \.npy file"):
        read(tmp_path, contents, "a.npy")
    with pytest.raises(cr.FileError, match=r"not an \.npy file: it begins with '1 2 3"):
        read(tmp_path, b"1 2 3\n", "b.npy")


def test_parquet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    x, y = np.transpose(PLACES)
    columns = {"x": x[::-1], "y": y[::-1], "status": ["a", "b", "c"], "load": LOADS[::-1]}
    assert read(tmp_path, columns, "a.parquet").values.tolist() == LOADS
    with pytest.raises(cr.InputError, match="entry 1, column load: found None, expected a finite"):
        read(tmp_path, {"load": [1.0, None, 2.0]}, "gap.parquet")
    with pytest.raises(cr.FileError, match=r"not an \.parquet file"):
        read(tmp_path, b"PAR1 and then nothing", "b.parquet")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(cr.FileError, match="needs pyarrow: pip install pyarrow"):
        read_forces(tmp_path / "a.parquet", SMALL, Manner())


def test_shear_forces_with_statuses(tmp_path: Path) -> None:
    content = "status,force [N],x,y\nopen,0,1,0\nsliding,-2,0,0\npartial,1,0.5,2.5\n"
    found = read_forces(tmp_path / put(tmp_path, content), SMALL, Manner(), "force")
    assert found.values.tolist() == [-2, 0, 1]
    assert found.status.tolist() == ["sliding", "open", "partial"]


def test_loads_at_a_slightly_different_place(tmp_path: Path) -> None:
    scene = rough()
    loads = cr.press(scene, approach=2e-5).loads
    x, y = scene.asperities.positions.T
    for shift, tolerances in ((0.009 * 0.0025, (None, 1e-5)), (0.011 * 0.0025, (1e-4, None))):
        columns = {"x": x + shift, "y": y, "load": loads}
        accepted, refused = tolerances
        found = read(tmp_path, columns, scene=scene, tolerance=accepted)
        assert np.array_equal(found.values, loads)
        said = rf"by \[{shift:.6g}, 0\], to within {refused or 2.5e-5:.6g}, exp"
        with pytest.raises(cr.InputError, match=said):
            read(tmp_path, columns, scene=scene, tolerance=refused)


def test_wrong_loads(tmp_path: Path) -> None:
    for content, expected in (
        ("load\n1\n-2\n3\n", "row 3, column load: found -2.0, expected a number that is not neg"),
        ("loads\n1\n2\n3\n", "found 'loads', expected a known column; did you mean \"load\"?"),
        ("x,y,load\n0,0,1\n0,0,1\n1,0,1\n", "row 3: found the same position as in row 2"),
        ("x,y,load\n0,0,1\n1,0,1\n0,2,1\n", "row 4: found position [0.0, 2.0], 0.707107 from"),
        ("1,2\n1,2\n1,2\n", "columns: found no header, 2 columns, expected a column 'load'"),
        ("node,load\n103,1\n101,1\n102,1\n", "column node: found 103, 101, ..., expected increas"),
        ("index,load\n1,1\n0.5,1\n2,1\n", "column index: found 0.5 in row 3, expected whole numb"),
        ("asperity,load\na1,1\na0,1\na2,1\n", "column asperity: found 'a1' in row 2, expected w"),
        ("x_pos,y_pos,load\n0,0,1\n1,0,1\n2,0,1\n", "expected --column x=x_pos --column y=y_pos"),
        (b"PK\x03\x04...", "not text: an archive or an Excel workbook; name it .xlsx"),
        (b"MATLAB 5.0 MAT-file", "not text: a MAT-file; name it .mat"),
        (b"load\n1\x00\n", "row 2: not text"),
    ):
        assert any(expected in line for line in refused(tmp_path, content)), expected


def test_all_mistakes_at_once_with_their_lines(tmp_path: Path) -> None:
    content = "x,y,load\n0,0,one\n1,0\n0.5,?,2\n7,7,nan\n"
    assert refused(tmp_path, content) == [
        "row 2, column load: found 'one', expected a finite number: 0,0,one",
        "row 5, column load: found nan, expected a finite number: 7,7,nan",
        "row 4, column y: found '?', expected a finite number: 0.5,?,2",
        "row 3: found 2 cells, expected 3, as in the header: 1,0",
    ]
    many = refused(tmp_path, "load\n" + "x\n" * 1000)
    assert len(many) == 11
    assert many[-1] == "and 990 more mistakes"


@pytest.mark.parametrize("unit", [b"1", b"1,", b"1 ", b'"', b"x,", b"\xff", b"#"])
@pytest.mark.sample(1)
def test_an_endless_line_is_refused(tmp_path: Path, unit: bytes) -> None:
    with pytest.raises(cr.FileError, match="row 2: longer than 16,777,216 characters"):
        read(tmp_path, b"load\n" + unit * (100_000_000 // len(unit)))
    (tmp_path / "loads.csv").unlink()


def test_summits(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    content = "y, x ,tip_radius,height\r\n0.5,0.25,0.1,1e-3\r\n-1,2,0.2,-1e-3\r\n\r\n"
    (tmp_path / "data/summits.csv").write_bytes(b"\xef\xbb\xbf" + content.encode())
    # The path is relative to the scene file, wherever the command runs.
    (tmp_path / "scene.toml").write_text(scene_text('pattern = "file"\npath = "data/summits.csv"'))
    asperities = cr.read_scene(tmp_path / "scene.toml").scene.asperities
    assert asperities.positions.tolist() == [[0.25, 0.5], [2.0, -1.0]]
    assert asperities.tip_radii.tolist() == [0.1, 0.2]
    assert asperities.heights.tolist() == [1e-3, -1e-3]


def test_the_spelling_of_a_heading(tmp_path: Path) -> None:
    for name in ("tip radius", "Tip-Radius", "TIP  RADIUS (m)", "tip\nradius", "radius [Metres]"):
        path = tmp_path / put(tmp_path, [[["x", "y", name], [0, 1, 2]]], "a.xlsx")
        found = read_summits(path, tip_radius=None, how=Reading(units=UnitNames("m")))
        assert found.tip_radii.tolist() == [2], name


WRONG_SUMMITS = [
    ("", "empty"),
    ("x,y\n", "rows: found none below the header"),
    ("x,y,heigth\n0,0,0\n", "found 'heigth', expected a known column; did you mean \"height\", or "
     'columns = {height = "heigth"} in [asperities]?'),
    ("X-Koord. [m],Y-Koord. [m],z,R\n0,0,0,1\n", "expected a column 'x': rename one, or columns = "
     '{x = "NAME", y = "NAME"} in [asperities]'),
    ("x,y,x\n0,0,0\n", "columns: found 'x' twice, expected once"),
    ("x,y\n0,0\n1,2,3\n", "row 3: found 3 cells, expected 2, as in the header: 1,2,3"),
    ('x,y\n0,"1\n', 'row 2: found quotes that do not end on this line: 0,"1'),
    ('x y\n0 "0\n1 1\n2 2\n', 'row 2: found quotes that do not end on this line: 0 "0'),
    ("z x y\n0 1 0\nbad 0 1\nNA 2 2\n", "row 3, column height: found 'bad', expected a finite num"),
    ("id x y\na 1 1\n5 0 1\nSum 0 1\nb 2 2\n", 'row 4: found a row of "Sum", expected none: re'),
    ("z x y\nno value 0 0\n0 1 1\n", "row 2: found 4 cells, expected 3, as in the header"),
    *((f"x{mark}y\n0{mark}0\n{error}{mark}1\n1{mark}1\n", f"row 3, column x: found '{error}', exp")
      for error in ("#NV", "#¡VALOR!", "#ÜBERLAUF!", "####") for mark in ";\t "),
    ("x,y\n0,1_000\n", "row 2, column y: found '1_000', expected a finite number"),
    ("x,y,tip_radius\n0,0,1\n", "tip radii: found both"),
    ("x,y,elevation,load,id\n0,0,1,2,3\n", "columns: found elevation, but no height, expect"),
    ("x,y,depth\n0,0,1\n", "sphere: write depths as negative heights"),
    ("x,y\n0,0\n", "tip radii: found neither"),
    ("x,y,z,diameter,R\n0,0,0,2,1\n", "found neither, expected either a column tip_radius or "
     'the key tip_radius in the scene file; not used: diameter, R; columns = {tip_radius = "'),
    ("x,y\n0,0\n0,0\n", "asperities 0 and 1"),
    *((f"x,y,{each}\n0,0,1\n", "column height: found mm, and a scene without units, expected")
      for each in ("height_mm", "Height mm", "z in mm", "HEIGHT.mm", "height_in_mm")),
    ("x,y,Summit,\n,,height,tip_radius\n0,0,1,2\n", "row 2: found 4 cells, expected 3, as in"),
    ("x [mil],y [mil],radius [inch]\n0,0,1\n", "column tip_radius: found inch, expected mil, as x"),
]  # fmt: skip


def test_comments_above_summits_could_state_a_unit(tmp_path: Path) -> None:
    """They are an error only if the scene names units and the header does not."""
    path, named = tmp_path / "summits.csv", Reading(units=UnitNames("m", "N"))
    path.write_text("# heights x 1000\nx,y,z\n0,0,1\n")
    assert len(read_summits(path, tip_radius=1.0, how=Reading(keyed=True))) == 1
    with pytest.raises(cr.ConvexroughError, match=r"heights x 1000', expected units .*, as x .m."):
        read_summits(path, tip_radius=1.0, how=named)


def test_wrong_summits(tmp_path: Path) -> None:
    for content, expected in WRONG_SUMMITS:
        path, tips = tmp_path / put(tmp_path, content), None if "neither" in expected else 1.0
        with pytest.raises(cr.ConvexroughError, match=re.escape(expected)) as caught:
            read_summits(path, tip_radius=tips, how=Reading(keyed=True))
        assert str(caught.value).startswith(str(path))


def test_a_run_names_what_it_does_not_use(run: Any, tmp_path: Path) -> None:
    """And the sheet that it reads, the first one with cells."""
    table = [["x", "y", "z", "R", "load", "label"], [0, 0, 0, 1, 2, "a"]]
    put(tmp_path, [[], table, [["notes"]]], "a.xlsx")
    summits = 'pattern = "file"\npath = "a.xlsx"\ntip_radius = 0.1'
    said = 'convexrough: note: a.xlsx: sheet "Sheet1" of 2, not used: R\n'
    assert run(scene_text(summits)).err.startswith(said)
