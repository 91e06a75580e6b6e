"""Files of maps as people have them, and as they should not be."""

import re
import sys
from importlib import import_module
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any
from warnings import catch_warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scene_files import put

import convexrough as cr

HEIGHTS = np.random.default_rng(3).normal(size=(7, 9))
Y, X = np.mgrid[:7, :9]


def raw(path: Path, made: Any = None, **options: Any) -> cr.surface.Surface:
    """A map as its file has it; of a file that is written first, if `made` is given."""
    if made is not None:
        put(path.parent, made, path.name)
    return cr.surface.read(path, detrend=None, **options)


def refused(said: str, *given: Any, error: Any = cr.InputError, **options: Any) -> None:
    with pytest.raises(error, match=said):
        raw(*given, **options)


def matrix(heights: Any = HEIGHTS, separator: str = " ", ending: str = "\n") -> str:
    return "".join(separator.join(map(repr, row)) + ending for row in np.asarray(heights).tolist())


def test_arrays(tmp_path: Path) -> None:
    alone, several = tmp_path / "a.npy", tmp_path / "a.npz"
    surface = raw(alone, HEIGHTS, pixel=2.0, unit="um")
    assert_array_equal(surface.heights, HEIGHTS)
    assert (surface.pixel, surface.unit, surface.filled) == ((2.0, 2.0), "µm", 0)
    assert surface.source == str(alone)
    assert raw(alone, HEIGHTS, pixel=np.array([1.0, 2.0])).pixel == (1.0, 2.0)
    sides = {"heights": HEIGHTS, "pixel": [2.0, 3.0]}
    surface = raw(several, sides | {"unit": "mm", "height_unit": "µm"})
    assert (surface.pixel, surface.unit) == ((2.0, 3.0), "mm")
    assert_allclose(surface.heights, 1e-3 * HEIGHTS, rtol=1e-15)
    axes = sides | {"x": 2.0 * X[0], "y": 3.0 * Y[:, 0]}
    assert raw(several, axes).pixel == (2.0, 3.0)
    single = HEIGHTS.astype(np.float32)
    assert_array_equal(raw(several, {"whatever": single}, pixel=1.0).heights, single)
    assert raw(alone, (100 * HEIGHTS).astype(np.int16), pixel=50.0).heights.dtype == np.float64
    points = np.column_stack([it.ravel() for it in (2.0 * X, 3.0 * Y, HEIGHTS)])[::-1]
    lists = dict(zip("xyz", points.T[:, :, None], strict=True))
    for path, made in ((alone, points), (tmp_path / "a.mat", lists)):
        surface = raw(path, made)
        assert_allclose(surface.heights, HEIGHTS)
        assert_allclose(surface.pixel, (2.0, 3.0))
    microns = {"pixel": 1.0, "unit": "µm"}
    for name in ("height_nm", "Z_nm", "topography in nm"):
        assert_allclose(raw(several, microns | {name: 1e3 * HEIGHTS}).heights, HEIGHTS, rtol=1e-14)
    more = {"scale": 0.5, "z_unit": "nm", "ok": HEIGHTS > 0, "log": np.zeros(3), "note": "in nm"}
    nano = microns | {"height_nm": HEIGHTS, "height_unit": "µm"}
    for arrays, said in (
        *((sides | {name: each}, f"arrays: found {name}, expected heights and pix")
          for name, each in more.items()),
        (axes | {"pixel": [2.0, 2.0]}, "pixel: found 2 by 2, expected 2 by 3, the steps of x"),
        (sides | {"x": X[0]}, "arrays: found only x, expected x and y, or neither"),
        (sides | {"x": X, "y": Y[:, 0]}, "found 7 by 9, expected 7 by 9, for y, too"),
        (sides | {"x": X[0], "y": [0.0]}, "expected 1 by 9, as y and x require"),
        ({"height": HEIGHTS, "z": 2 * HEIGHTS}, 'found height, z, expected one called "heights"'),
        (nano, "height_unit: found µm, expected nm, as the file says"),
        *(({"heights": np.zeros(shape), "pixel": 1.0}, "heights: found shape .* at least 3 of each")
          for shape in ((0, 5), (5, 0), (0,))),
        (sides | {"heights": np.vstack((X[:1], HEIGHTS))}, "row 1: found 0, 1, 2, 3, .*, exp"),
    ):  # fmt: skip
        refused(said, several, arrays)
    for beside, said in (
        ({"scale": 0.5, "of": {"unit": "nm"}}, "arrays: found info.scale, info.of.unit, exp"),
        (np.array(["scale", 0.5], dtype=object), "arrays: found info, expected heights and pixel"),
    ):
        refused(said, tmp_path / "b.mat", {"heights": HEIGHTS, "info": beside}, pixel=1.0)
    for named in (np.array(["µm"]), "µm".encode()):
        assert raw(several, sides | {"unit": named}).unit == "µm"


def test_what_gwyddion_writes(tmp_path: Path) -> None:
    head = "# Channel: Height\n# Width: 18.0 µm\n# Height: 21.0 µm\n# Value units: nm\n"
    surface = raw(tmp_path / "map.txt", head + matrix(1e2 * HEIGHTS, "\t"))
    assert (surface.pixel, surface.unit) == ((2.0, 3.0), "µm")
    assert_allclose(surface.heights, 0.1 * HEIGHTS, rtol=1e-14)


def test_lists(tmp_path: Path) -> None:
    rows = np.column_stack((10 * X.ravel() + 3, 20 * Y.ravel(), HEIGHTS.ravel()))
    content = matrix(np.random.default_rng(0).permutation(rows), ",")
    headers = "x [mm], y [mm], Höhe [µm]\n", "X/mm,Y/mm,Z/µm\n", "# x (mm),y (mm),z (µm)\n", ""
    for header in headers:
        surface = raw(tmp_path / "list.csv", header + content)
        assert_allclose(surface.pixel, (10, 20), rtol=1e-12)
        assert surface.unit == ("mm" if header else "")
        assert_allclose(surface.heights, HEIGHTS * (1e-3 if header else 1), rtol=1e-14)
    more = "".join(f"{i},{line}\n" for i, line in enumerate(content.splitlines()))
    assert_allclose(raw(tmp_path / "a.csv", f"id,x,y,z\n{more}").heights, HEIGHTS)


def test_rounded_coordinates_and_spaced_rows(tmp_path: Path) -> None:
    heights = np.random.default_rng(4).normal(size=(40, 40)) * 1e-3
    rows = [f"{6.5e-4 * i:.4f} {6.5e-4 * j:.4f} {heights[j, i]!s}" for j, i in np.ndindex(40, 40)]
    surface = raw(tmp_path / "a.xyz", "\n".join(rows))
    assert_array_equal(surface.heights, heights)
    assert_allclose(surface.pixel, 0.65e-3, rtol=5e-3)
    blocks = "\n\n".join("\n".join(rows[i : i + 40]) for i in range(0, 1600, 40))  # as for splot
    assert_array_equal(raw(tmp_path / "b.xyz", blocks).heights, heights)
    spaced = raw(tmp_path / "a.txt", "\n\n" + matrix(ending="\n\n") + "\n\n", pixel=1.0)
    assert_array_equal(spaced.heights, HEIGHTS)


@pytest.mark.parametrize(("separator", "mark"), [(";", ","), (";", "."), ("\t", ","), (" ", ",")])
def test_decimals_after_many_whole_numbers(tmp_path: Path, separator: str, mark: str) -> None:
    cells = np.full((400, 8), "0", dtype=object)
    cells[350:] = f"-0{mark}25"
    surface = raw(tmp_path / "a.txt", "\n".join(map(separator.join, cells)), pixel=1.0)
    assert_array_equal(surface.heights[348:352, 0], [0, 0, -0.25, -0.25])


@pytest.mark.parametrize("form", ["vectors", "matrices", "matrices along x"])
def test_matlab_with_axes(tmp_path: Path, form: str) -> None:
    x, y = (2 * X[0], 3 * Y[:, 0]) if form == "vectors" else (2 * X, 3 * Y)
    turned = "T" if "along" in form else "real"
    arrays = {"X": getattr(x, turned), "Y": getattr(y, turned), "z": getattr(HEIGHTS, turned)}
    surface = raw(tmp_path / "a.mat", arrays)
    assert_allclose(surface.pixel, (2, 3))
    assert_array_equal(surface.heights, HEIGHTS)
    refused("as y and x require; transpose it", tmp_path / "a.mat", arrays | {"z": arrays["z"].T})


#: Of holes, and where they are: two pixels, whole rows and columns.
MARKS = ("nan", "BAD", "-9999", "1.70141e38", "N/A", "#N/A", "77777", "#NV", "---", "***", "")
PLACES = (np.s_[3, 4:6], np.s_[3], np.s_[:, 3], np.s_[:, -1], np.s_[0])


@pytest.mark.sample(6)
@pytest.mark.parametrize("mark", MARKS)
@pytest.mark.parametrize("listed", [False, True])
def test_holes(tmp_path: Path, mark: str, listed: bool) -> None:
    separators, places = (",;\t ", PLACES) if mark else (",;\t", PLACES[:2])  # else empty lines
    for separator, place in product(separators, places):
        cells = np.array([[f"{each:.9f}" for each in row] for row in HEIGHTS], dtype=object)
        cells[place] = mark
        holes = cells == mark
        points = np.column_stack([it.ravel().astype(str) for it in (X, Y, cells)])
        rows = np.vstack((["x", "y", "z"], points)) if listed else cells
        made = "\n".join(map(separator.join, rows))
        refused(rf"found {holes.sum()} holes .*--fill", tmp_path / "a.txt", made, pixel=1.0)
        filled = raw(tmp_path / "a.txt", pixel=1.0, fill=True)
        assert_array_equal(filled.filled_pixels, holes)
        assert_allclose(filled.heights[~holes], HEIGHTS[~holes], atol=1e-9)


def test_the_only_sheet(tmp_path: Path) -> None:
    path = tmp_path / "a.xlsx"
    points = [["x", "y", "z"], *np.column_stack([X.ravel(), Y.ravel(), HEIGHTS.ravel()]).tolist()]
    for sheet in (HEIGHTS.tolist(), points):
        surface = raw(path, [[], sheet], pixel=1.0)
        assert_allclose(surface.heights, HEIGHTS)
        assert surface.source == f'{path}, sheet "Sheet1"'
        two, said = [sheet, [["Pixel", 0.5]]], 'found cells in the sheets "Sheet", "Sheet1", exp'
        refused(said, path, two, pixel=1.0, error=cr.FileError)
    beside = [[None, *row] for row in points]  # as from column B on
    assert_allclose(raw(path, [beside]).heights, HEIGHTS)
    titled = [["Surface map"], [], *HEIGHTS.tolist()]
    units = {"pixel": 1.0, "unit": "nm", "height_unit": "nm"}
    assert_allclose(raw(path, [titled], **units).heights, HEIGHTS)


def test_few_decimals_are_no_thousands(tmp_path: Path) -> None:
    """Not without a whole number; 0, and 999 and more, which can mark holes, say nothing."""
    for cells in ("1.125 0 3.250", "1.125 -999 12.250", "1.125 -9999 120", "1.125 120 0.125"):
        heights = np.outer([1, 1, 1], np.float64(cells.split()))
        surface = raw(tmp_path / "a.txt", f"{cells} 7.5\n" * 3, pixel=1.0, fill=True)
        assert_array_equal(surface.heights[:, 0], heights[:, 0])


HOLED = np.where(X == Y, np.nan, HEIGHTS)
ONE = {"pixel": 1.0}

#: Two columns of coordinates and two of values; and a matrix whose rows are numbered.
INDEXED = "".join(f"{i},{j},{i % 7 + j % 3},5\n" for i in range(9) for j in range(7))
NUMBERED = "".join(f"{i},{line}\n" for i, line in enumerate(matrix(separator=",").split()))

#: Heights of about 1000, and some of which only the largest exceeds 999, with a mark between groups
#: of three digits.
THOUSANDS = "1,003;1,021;997;1,040\n" * 10 + "1,011;990;1,007;1,002\n" * 10
FEW_THOUSANDS = "827;12;9;640\n" * 4 + "827;1.013;9;640\n"

#: The header of an ESRI grid, with a matrix.
ESRI = "ncols 9\nnrows 7\nxllcorner -3.0\nYLLCENTER 1e3\ncellsize 2.5\nNODATA_value 0\n@"

#: Contents, in which @ is a matrix, with options, and what is said of them.
WRONG: list[tuple[str, dict[str, Any], str]] = [
    ("0.5 1.5 no 2.5\n@", ONE, "row 1: found 0.5 1.5 no 2.5, expected heights, as in the rows bel"),
    (ESRI.replace("7", "8"), {}, "header: found ncols 9, nrows 8, .*expected nrows 7 and ncols 9"),
    (ESRI.replace("cellsize 2.5\n", "dx 1\n"), ONE, "header: .*, cellsize or dx and dy, each once"),
    (f"cellsize 2\n{ESRI}", {}, "header: found cellsize 2, .*, cellsize 2.5, .* each once"),
    (f"# Width: 9 m\n# Height: 7 m\n{ESRI}", {}, "header: found width, height, ncols"),
    (ESRI, {"pixel": 2.0}, "pixel: found 2 by 2, expected 2.5 by 2.5, as the file states"),
    ("-0,359,-0,042,0,100\n" * 3, ONE, "rows: found decimals between commas, expected decimal p"),
    *((f"1,9{apart}-0,7{apart}12,3\n-0,4{apart}2,0{apart}-3,1\n8,8{apart}0,1{apart}1,2\n", ONE,
       "rows: found decimals between commas, expected decimal p") for apart in (",", ", ")),
    ("% x y z in mm\n0 0 1\n1 0 2\n0 1 1\n1 1 1\n", {}, r"comments: found % x y z in mm, expected"),
    ("@", {}, "pixel: found none, expected its size, which the file does not state"),
    (matrix(HOLED), ONE, r"found 7 holes \(nan\) in 63 pixels, .*fill=True, --fill"),
    (matrix(np.full((7, 9), np.nan)), ONE | {"fill": True}, "expected some heights"),
    (matrix(np.ones((7, 9))), ONE, "found 1 everywhere, expected a rough surface"),
    (matrix(1e9 * HEIGHTS), ONE, "rms slope .* give height_unit"),
    ("@", ONE | {"unit": "nm", "height_unit": "um"}, "rms slope .* check height_unit, µm, and"),
    ("@", {"pixel": (1.0, 1.0, 1.0)}, "found 3 numbers"),
    ("# x y quality\n0,0,1\n1,0,2\n", ONE, "columns: found x, y, quality, expected a column"),
    (INDEXED, ONE, "columns: found 4 columns without a header, expected their names above them"),
    ("@", {"pixel": (1.0, 30.0)}, "found 1 by 30, expected sides at most 1 to 10"),
    ("@", ONE | {"fill": "no"}, "fill: found no, expected True or False"),
    ("@", ONE | {"unit": 5}, "unit: found 5, expected a name, as"),
    ("@", ONE | {"height_unit": "nm"}, "unit: found none, expected the unit of"),
    ("# Width: 9 µm\n# Height: 7 µm\n@", {"unit": "nm"}, "unit: found nm, expected "),
    ("# Width: 9 µm\n# Height: 7 nm\n@", {}, "units: found µm and nm, expected one"),
    *((f"# Width: 9 µm\n# Height: {each}\n@", ONE, f"found width 9 µm, height {each}, expected a w")
      for each in ("1,000 µm", "twice")),
    ("# Width: 9 m\n# Height: 7 m\n# Width: 9 mm\n@", {}, "found width 9 m, height 7 m, width 9 m"),
    ("# Height: 7 µm\n@", ONE | {"unit": "mm"}, "comments: found height 7 µm, expected a wid"),
    ("# Width: 9 m\n# Height: 7 m\n@", {"pixel": 2.0}, "found 2 by 2, expected 1 by"),
    ("@" + matrix([HEIGHTS.mean(axis=0).round(3)]), ONE, "last row: found the means of"),
    ("# Value units: V\n@", ONE | {"unit": "m"}, "height_unit: found 'V'"),
    ("@\n@", ONE, "without numbers between rows 7 and 9, expected one map"),
    ('"-0,1","0,2","0,1","0,4"\n' * 4, ONE, "row 1, column 1: found '-0,1', expected a decimal"),
    ("@1 2\n", ONE, "row 8: found 2 cells, expected 9, as in most rows: 1 2"),
    ("x,y,z\n1,1,1\n2,2,2\n1,1,3\n2,1,1\n", {}, "x, y: found the point 1, 1 2 times, exp"),
    ("x,y,z\n1,1,1\n2,2,2\n3.3,1,1\n4,1,1\n", {}, "x: found .*, expected coordinates"),
    ("x,y,z\n0,1,1\n1,2,2\n3,1,1\n3,2,1\n", {}, "x: found 1, expected coordinates 1.5 ap"),
    ("x,y,z\n1,1,1\n1,2,2\n1,3,1\n", {}, "x: found one value or none"),
    ("x [m],y [mm],z\n1,1,1\n1,2,2\n", {}, "units: found m and mm, expected one along x and y"),
    ("x,y,z,valid\n0,0,1,1\n1,0,2,0\n0,1,3,1\n1,1,4,1\n", {}, "columns: found valid, e"),
    ("x,y,z,id\n0,0,1,1\n1,0,2,0\n0,1,3,1\n1,1,4,1\n", {}, "columns: found id, e"),
    ("", {}, "empty"),
    ("0 1 2 3 4 5 6 7 8\n@", ONE, "row 1: found 0, 1, 2, .*, expected heights alone"),
    (NUMBERED, ONE, "column 1: found 0, 1, 2, .*, expected heights alone: leave coord"),
    (THOUSANDS, ONE, "row 1: found 1,003, and 990 in row 11, expected .* thousands"),
    (FEW_THOUSANDS, ONE, "row 5: found 1.013, and 827 in row 1, expected .* thousands"),
    ("x;y;z\n0;0;827\n0;1;9\n1;0;1.000\n1;1;12\n", {}, "row 4: found 1.000, and 827 in row 2"),
    (THOUSANDS.replace(",", "'"), ONE, "found \"1'003\", expected .* no thousands separators"),
    (" ".join((*matrix().split(" ")[:-1], "-1.#IND")), ONE, "found '-1.#IND'"),
]  # fmt: skip


@pytest.mark.sample(10)
@pytest.mark.parametrize(("content", "options", "message"), WRONG)
def test_wrong_files(tmp_path: Path, content: str, options: Any, message: str) -> None:
    path = tmp_path / put(tmp_path, content.replace("@", matrix()), "map.txt")
    with pytest.raises(cr.ConvexroughError, match=message) as caught:
        cr.surface.read(path, **options)
    assert all(line.count(str(path)) == 1 for line in str(caught.value).splitlines())


@pytest.mark.parametrize("width", [9, 3])  # three columns without a header are a list
def test_an_esri_grid(tmp_path: Path, width: int) -> None:
    """Its first row is that of the largest y; the mark of holes can be any number."""
    heights = np.where(X == 2 * Y, 0.0, HEIGHTS)[:, :width]
    content = ESRI.replace("9", str(width)).replace("@", matrix(heights))
    surface = raw(tmp_path / "map.asc", content, unit="m", fill=True)
    assert (surface.pixel, surface.comments) == ((2.5, 2.5), ())
    assert_array_equal(surface.filled_pixels, (heights == 0)[::-1])
    assert_array_equal(surface.heights[3, :2], heights[3, :2])
    sides = content.replace("cellsize 2.5", "dy 2,5\ndx 0,5")
    assert raw(tmp_path / "b.asc", sides, unit="m", fill=True).pixel == (0.5, 2.5)


@pytest.mark.parametrize("said", ["# z [nm]", "# Operator: Anna", "Sample 3, after polishing"])
def test_comments_may_hold_units_or_factors(tmp_path: Path, said: str) -> None:
    path, made = tmp_path / "map.txt", f"{said}\n{matrix()}"
    for known in ({}, {"pixel": 1.0}, {"pixel": 1.0, "unit": "µm"}, {"height_unit": "µm"}):
        refused(rf"comments: found {re.escape(said)}, expected no", path, made, **known)
    surface = raw(path, made, pixel=1.0, unit="µm", height_unit="µm")
    assert (surface.pixel, surface.comments) == ((1.0, 1.0), (said,))


def test_text_above_the_numbers_is_a_comment(tmp_path: Path) -> None:
    """Above a matrix and above columns, in which No Data marks a hole."""
    known = {"pixel": 1.0, "unit": "µm", "height_unit": "µm"}
    text = "Instrument: FocusVar X\nDate: 2026-03-01\nPoints X: 9\n\n"
    surface = raw(tmp_path / "map.txt", text + matrix(), **known)
    assert_array_equal(surface.heights, HEIGHTS)
    assert surface.comments == tuple(text.strip().splitlines())
    rows = [f"{i} {j} {HEIGHTS[j, i]!s}" for j, i in np.ndindex(7, 9)]
    rows[5] = "5 0 No Data"
    for title in ("Sample 3, after polishing\n", ""):
        surface = raw(tmp_path / "map.xyz", title + "\n".join(rows), fill=True, **known)
        assert np.argwhere(surface.filled_pixels).tolist() == [[0, 5]]
        assert_array_equal(surface.heights[1:], HEIGHTS[1:])
    turned = raw(tmp_path / "map.xyz", "Sample A\n# y x z\n" + "\n".join(rows), fill=True, **known)
    assert_array_equal(turned.heights.T, surface.heights)


METROPRO = bytes.fromhex("881b036f000100000342") + bytes(2000)


def test_without_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    said = r"a\.png: found \.png, expected a map in \.npy, .* needs SurfaceTopography: pip"
    refused(said, tmp_path / "a.png", b"PNG", error=cr.FileError)
    refused(said.replace("png", "dat"), tmp_path / "a.dat", METROPRO, error=cr.FileError)
    refused(r"missing\.x3p: cannot be read: No such", tmp_path / "missing.x3p", error=cr.FileError)


@pytest.mark.skipif(
    find_spec("SurfaceTopography") is None,
    reason="instruments' files are read by SurfaceTopography, which only they need: pip install it",
)
class TestInstruments:
    """Round trips through formats that SurfaceTopography writes, too."""

    def written(self, path: Path, heights: Any = HEIGHTS) -> Path:
        with catch_warnings(action="ignore", category=ImportWarning):
            made = import_module("SurfaceTopography").Topography
        topography = made(heights.T, (18.0, 21.0), unit="µm")
        kind = path.suffix.removeprefix(".").replace("nc", "netcdf")
        getattr(topography, f"to_{kind}")(str(path))
        return path

    @pytest.mark.parametrize("kind", ["nc", "x3p", "gwy"])
    def test_a_map_comes_back(self, tmp_path: Path, kind: str) -> None:
        surface = raw(self.written(tmp_path / f"a.{kind}"), unit=None)
        scale = {"m": 1e-6, "µm": 1.0}[surface.unit]
        assert_allclose(surface.pixel, (2.0 * scale, 3.0 * scale), rtol=1e-9)
        assert_allclose(surface.heights, scale * HEIGHTS, rtol=1e-6, atol=1e-7 * scale)

    def test_masked_pixels_are_holes(self, tmp_path: Path) -> None:
        path = self.written(tmp_path / "a.x3p", np.ma.masked_array(HEIGHTS, X == 4))
        refused(r"7 holes \(nan\) in 63 pixels", path)
        assert raw(path, fill=True).filled == 7

    def test_what_is_refused(self, tmp_path: Path) -> None:
        refused(r"a\.nc: unit: found mm, expected µm", self.written(tmp_path / "a.nc"), unit="mm")
        header = b"fileformat = bcrstm\nheadersize = 99\nxpixels = 2\nypixels = 2\n"
        for name, made, said in (
            ("a.bin", b"\1\2\3" * 50, r"a\.bin: SurfaceTopography cannot read it"),
            ("b.gwy", None, r"b\.gwy: cannot be read: No such file"),
            ("a.bcr", header.ljust(200), r"cannot read it: KeyError\('xlength'\)"),
        ):
            refused(said, tmp_path / name, made, error=cr.FileError)

    def test_of_several_maps_the_first_is_read(self, tmp_path: Path) -> None:
        held = self.written(tmp_path / "a.gwy").read_bytes()[21:]
        both = held + held.replace(b"/0/", b"/1/")
        gwy = b"GWYPGwyContainer\0" + len(both).to_bytes(4, "little") + both
        several = raw(tmp_path / "b.gwy", gwy, unit=None)
        assert several.source.split(", ", 1)[1].startswith("the first of its maps ")

    def test_a_map_without_its_size(self, tmp_path: Path) -> None:
        """The unit of its heights is not that of the pixel that is given."""
        with import_module("h5py").File(tmp_path / "a.h5", "w") as file:
            file["surface"] = HEIGHTS.T
        refused("pixel: found none, expected its size", tmp_path / "a.h5")
        assert_array_equal(raw(tmp_path / "a.h5", pixel=1.0).heights, HEIGHTS)
        refused("expected the unit of the pixel, as h", tmp_path / "a.dat", METROPRO, pixel=1.0)
