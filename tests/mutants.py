"""Spoiled files: scenes, summits, loads, shear forces and proofs, each drawn from a number."""

import io
import json
import random
import re
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scene_files import scene_text

import convexrough as cr

#: Of a line that is far too long.
LONG = 100_000_000

POINTS = [(0.0, 0.0), (0.0025, 0.0), (-0.0025, 0.0), (0.0, 0.003), (0.001, -0.003)]
FRICTION = "[friction]\ncoefficient = 0.5\n"
STAGES = """
[shear]
fractions = [0.25, 0.5]
[cycle]
maximum_fraction = [0.3]
loop_points = 8
[history]
fractions = [0.3, -0.3, 0.1]
"""
PATHS = """
[path]
loads = [1.0, 0.5]
forces = [0.0, 0.1]
reference = 1e-8
[steady]
ellipse = {load = 1.0, force_amplitude = 0.1, chords = 12}
reference = 1e-8
[shakedown]
loads = 1e-8
force_amplitudes = [1e-9]
kind = "elastic"
"""
SUMMITS = 'pattern = "file"\npath = "{}"\ntip_radius = 0.02'
LATTICE = 'pattern = "hexagonal"\nspacing = 0.0025\ntip_radius = 0.02\nwithin = 0.006'
UNITS = '[units]\nlength = "mm"\nforce = "N"\n[solver]\nname = "newton"\n'

#: What a number becomes.
NUMBERS = (
    *("1e308", "-1e308", "1e400", "1e-308", "5e-324", "1e60", "1e-60", "1e61", "1e-61", "nan"),
    *("inf", "-inf", "-0.0", "0", "-1", "1", "1_000", "0x1F", "0b1", "1.", ".5", "1,5", "1d-3"),
    *("9" * 4000, "9" * 5000, "1" + "0" * 30, "2147483648", "9223372036854775808", "true"),
    *("1979-05-27", '"0.02"', "[]", "[[0.02]]", "{}", "0.02 mm", "", "1e-15", "1e15", "1e5", "7"),
)


class Mutant(NamedTuple):
    """How it was made, the files of its folder, and the command."""

    how: str
    files: dict[str, bytes]
    arguments: list[str]


def mutant(seed: int) -> Mutant:
    """The one of this number."""
    rng = random.Random(seed)
    make = (_scene, _scene, _table, _table, _arrays, _proof)[seed % 6]
    return make(rng)


# Whole files --------------------------------------------------------------------------------------


def _scene(rng: random.Random) -> Mutant:
    stages = rng.choice(["", FRICTION, FRICTION + STAGES, FRICTION + PATHS, UNITS])
    layout = rng.choice([LATTICE, SUMMITS.format("summits.csv")])
    normal = rng.choice(["approach = 5e-5", "load = 1e-8"])
    text = scene_text(layout, normal, stages)
    how, contents = _spoiled(rng, text.encode(), TEXTS + TOMLS)
    files = {"a.toml": contents, "summits.csv": _table_text(rng, ("x", "y")).encode()}
    return Mutant(f"scene {how}", files, _run(rng))


def _table(rng: random.Random) -> Mutant:
    """A file of summits, of loads, or of shear forces."""
    kind = rng.choice(["summits", "loads", "forces"])
    names = {
        "summits": ("x", "y", "height"),
        "loads": rng.choice([("load",), ("x", "y", "load")]),
        "forces": ("x", "y", "force", "status"),
    }[kind]
    how, contents = _spoiled(rng, _table_text(rng, names).encode(), TEXTS + CELLS)
    return _with_table(rng, kind, f"{kind}.csv", f"{kind} {how}", contents)


def _arrays(rng: random.Random) -> Mutant:
    """The same as .npy, .npz or Parquet, or as something that is named so."""
    kind, form = rng.choice(["summits", "loads"]), rng.choice(["npy", "npz", "parquet"])
    how, contents = _spoiled(rng, _array_file(rng, kind, form), BYTES)
    return _with_table(rng, kind, f"{kind}.{form}", f"{kind}.{form} {how}", contents)


def _proof(rng: random.Random) -> Mutant:
    how, contents = _spoiled(rng, _honest_proof(), TEXTS + JSONS)
    return Mutant(f"proof {how}", {"proof.json": contents}, ["check", "proof.json"])


def _run(rng: random.Random) -> list[str]:
    more = rng.choice([[], ["--json"], ["--proof"], ["--html"]])
    return ["run", "a.toml", "--no-figures", "--force", *more]


def _with_table(rng: random.Random, kind: str, name: str, how: str, contents: bytes) -> Mutant:
    files = {"summits.csv": _plain(("x", "y")), name: contents}
    asked = name if kind == "summits" else "summits.csv"
    text = scene_text(SUMMITS.format(asked), "approach = 2e-5", FRICTION)
    if kind == "summits" and rng.random() < 0.5:
        text = text.replace("tip_radius = 0.02", "")
    files["a.toml"] = text.encode()
    if kind == "summits":
        return Mutant(how, files, _run(rng))
    arguments = ["verify", "a.toml", name]
    if kind == "forces":
        files["loads.csv"] = _plain(("load",))
        arguments = ["verify", "a.toml", "loads.csv", "--shear", name, "--shear-force", "1e-10"]
    return Mutant(how, files, [*arguments, *rng.choice([[], ["--json"], ["--proof"]])])


def _values(names: tuple[str, ...]) -> dict[str, list[Any]]:
    x, y = zip(*POINTS, strict=True)
    n = len(POINTS)
    whole = {"x": x, "y": y, "height": [0.0, 1e-7, 0.0, -1e-7, 0.0], "load": [2e-9] * n}
    whole |= {"force": [1e-10] * n, "status": ["partial"] * n}
    return {name: list(whole[name]) for name in names}


def _plain(names: tuple[str, ...]) -> bytes:
    return _table_text(random.Random(0), names).encode()


def _table_text(rng: random.Random, names: tuple[str, ...]) -> str:
    separator = rng.choice([",", ";", "\t", " "])
    rows = [names, *zip(*_values(names).values(), strict=True)]
    return "\n".join(separator.join(map(str, row)) for row in rows) + "\n"


def _array_file(rng: random.Random, kind: str, form: str) -> bytes:
    columns = _values(("x", "y") if kind == "summits" else ("load",))
    out = io.BytesIO()
    if form == "parquet":
        import pyarrow
        from pyarrow import parquet

        parquet.write_table(pyarrow.table(columns), out)
    elif form == "npz":
        named = {name: _odd_array(rng, np.array(values)) for name, values in columns.items()}
        np.savez(out, **named)
    else:
        np.save(out, _odd_array(rng, np.array(list(columns.values())).T), allow_pickle=True)
    return out.getvalue()


def _odd_array(rng: random.Random, values: Any) -> Any:
    """Mostly as it is; else of a type or shape that nobody expects."""
    if rng.random() < 0.5:
        return values
    with np.errstate(all="ignore"):
        return rng.choice(_odd_arrays(values))


def _odd_arrays(values: Any) -> list[Any]:
    return [
        *(values.astype(kind) for kind in ("f2", "f4", "i8", "c16", "?", "U9", "S3", "O", ">f8")),
        *(values[..., None, None], values[:0], values * np.nan, values.ravel()[0], -values),
        *(np.asfortranarray(values), values * np.inf, np.broadcast_to(np.zeros(1), (5, 1))),
        np.zeros(5, [("x", "f8"), ("y", "f8"), ("load", "f8")]),
        np.zeros(5, "M8[s]"),
    ]


@cache
def _honest_proof() -> bytes:
    scene = cr.Scene(
        1.0, cr.Asperities(POINTS, 0.02), cr.Material(1.0, 0.3), friction=0.5, geometry="summit"
    )
    contact = cr.press(scene, approach=2e-5)
    proof = contact.proof(sheared=[cr.shear(contact, force=0.1 * contact.load)])
    return json.dumps(proof.document).encode()


# How they are spoiled -----------------------------------------------------------------------------

Spoil = Callable[[random.Random, bytes], bytes]


def _spoiled(rng: random.Random, contents: bytes, ways: tuple[Spoil, ...]) -> tuple[str, bytes]:
    names = []
    for _ in range(rng.choice([1, 1, 2])):
        way = rng.choice(ways)
        contents = way(rng, contents)
        names.append(way.__name__)
    return "+".join(names), contents


def truncated(rng: random.Random, contents: bytes) -> bytes:
    return contents[: rng.randrange(len(contents) + 1)]


def one_byte(rng: random.Random, contents: bytes) -> bytes:
    place = rng.randrange(len(contents) + 1)
    new = bytes([rng.randrange(256)])
    return contents[:place] + new + contents[place + rng.randrange(2) :]


def some_bytes(rng: random.Random, contents: bytes) -> bytes:
    """As a disk loses them: a block that is zero, random, or of elsewhere in the file."""
    place, size = rng.randrange(len(contents) + 1), rng.choice([1, 8, 64, 512])
    source = rng.randrange(len(contents) + 1)
    block = rng.choice([bytes(size), rng.randbytes(size), contents[source : source + size]])
    return contents[:place] + block + contents[place + size :]


def binary(rng: random.Random, contents: bytes) -> bytes:
    heads = [b"", b"PK\x03\x04", b"\x89HDF", b"\x1f\x8b\x08", b"%PDF-1.4", b"PAR1", b"\x93NUMPY"]
    return rng.choice(heads) + rng.randbytes(rng.choice([1, 10, 1000, 100_000]))


def empty(rng: random.Random, contents: bytes) -> bytes:
    return rng.choice([b"", b"\n", b" ", b"\n\n\n", b"\xef\xbb\xbf", b"#", b"\0", b"\r", b"\x1a"])


def encoded(rng: random.Random, contents: bytes) -> bytes:
    text = contents.decode("latin-1") + rng.choice(["", "# \u00e9\u03bc", "\u2212", "\u3000"])
    codec = rng.choice(
        ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-7", "cp1252", "shift_jis", "utf-8-sig"]
    )
    return text.encode(codec, "replace")


def line_ends(rng: random.Random, contents: bytes) -> bytes:
    ends = [b"\r\n", b"\r", b"\n\r", b"\n\n", b"\x0b", b"\x0c", b"\xc2\x85", b"\xe2\x80\xa8", b"\0"]
    return contents.replace(b"\n", rng.choice(ends))


def lines_moved(rng: random.Random, contents: bytes) -> bytes:
    """Lines twice, gone, or in another order."""
    lines = contents.split(b"\n")
    place, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    kind = rng.choice(["twice", "gone", "swapped", "all twice"])
    if kind == "twice":
        lines.insert(other, lines[place])
    elif kind == "gone":
        del lines[place]
    elif kind == "swapped":
        lines[place], lines[other] = lines[other], lines[place]
    else:
        lines *= 2
    return b"\n".join(lines)


def _replaced(rng: random.Random, contents: bytes, pattern: bytes, new: bytes) -> bytes:
    """Something new in place of one of the finds."""
    found = list(re.finditer(pattern, contents))
    if not found:
        return contents
    place = rng.choice(found)
    return contents[: place.start()] + new + contents[place.end() :]


def other_number(rng: random.Random, contents: bytes) -> bytes:
    return _replaced(rng, contents, rb"-?\d[\d.]*(?:e-?\d+)?", rng.choice(NUMBERS).encode())


def odd_text(rng: random.Random, contents: bytes) -> bytes:
    """A word by others: control characters, other alphabets, quotes, no characters at all."""
    strings = ["\0", "\x1b[31m", "\u202e", "\U0001f600", '"', "'''", '"""', "\\", "=", "../..", "~"]
    strings += ["/dev/null", ".", "x" * 5000, "\ud800", "%s%n", "{0.__class__}", "true", "nan", "-"]
    new = rng.choice(strings).encode("utf-8", "surrogatepass")
    return _replaced(rng, contents, rb"[A-Za-z_]{2,}", new)


def deep(rng: random.Random, contents: bytes) -> bytes:
    depth = rng.choice([50, 500, 5_000, 50_000])
    opened, closed = rng.choice([(b"[", b"]"), (b"{a=", b"}"), (b'{"a":', b"}"), (b"(", b")")])
    nested = opened * depth + rng.choice([b"", b"1" + closed * depth])
    return rng.choice([nested, b"a = " + nested, contents + b"\n[deep]\na = " + nested])


def long_line(rng: random.Random, contents: bytes) -> bytes:
    """Of 100 MB, now and then; mostly of 100 kB."""
    size = LONG if rng.random() < 0.03 else 100_000
    piece = rng.choice([b"x", b"1.5,", b"1.5 ", b"[", b'"', b" ", b"#", b"1", b"a.", b"\xff"])
    line = (piece * (size // len(piece) + 1))[:size]
    return rng.choice([line, contents + b"\n" + line, b"a = " + line, b"# " + line + b"\n"])


def long_list(rng: random.Random, contents: bytes) -> bytes:
    """Where a number or a list was."""
    values = b", ".join([rng.choice([b"0.5", b"1e-9", b"0", b"-0.5"])] * rng.choice([1, 7, 2000]))
    return _replaced(rng, contents, rb"= (\[.*\]|[\d.e-]+)", b"= [" + values + b"]")


def other_path(rng: random.Random, contents: bytes) -> bytes:
    path = rng.choice(
        [b".", b"..", b"/", b"a.toml", b"none.csv", b"", b"/dev/null", b"a\\u0000b", b"x" * 5000]
    )
    return contents.replace(b"summits.csv", path)


def quoted(rng: random.Random, contents: bytes) -> bytes:
    """Cells in quotes that do not end, or that hold separators and lines."""
    lines = contents.split(b"\n")
    place = rng.randrange(len(lines))
    lines[place] = rng.choice([b'"', b'"a"b,', b'"1\n2",', b"'", b'""""']) + lines[place]
    return b"\n".join(lines)


def wide(rng: random.Random, contents: bytes) -> bytes:
    count = rng.choice([2, 100, 20_000])
    end = rng.choice([b",", b";1", b"\t", b" 1.5"]) * count
    return contents.replace(b"\n", end + b"\n", rng.choice([1, -1]))


def other_json(rng: random.Random, contents: bytes) -> bytes:
    """JSON that Python reads and nobody should write."""
    values = [b"NaN", b"1e999", b"9" * 5000, b"null", b'"\\ud800"', b"{}", b"[]", b"true", b"-0"]
    return _replaced(rng, contents, rb'"[^"]*"(?=[,\]}])', rng.choice(values))


BYTES: tuple[Spoil, ...] = (truncated, one_byte, some_bytes, some_bytes, binary, empty)
TEXTS: tuple[Spoil, ...] = (
    *(truncated, one_byte, some_bytes, binary, empty, encoded, line_ends, lines_moved),
    *(other_number, other_number, other_number, odd_text, odd_text, deep, long_line),
)
TOMLS: tuple[Spoil, ...] = (long_list, long_list, other_path, other_number)
CELLS: tuple[Spoil, ...] = (quoted, wide, other_number)
JSONS: tuple[Spoil, ...] = (other_json,)
