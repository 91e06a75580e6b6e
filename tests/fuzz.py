"""Mutated files through the command line: an answer, or a clear error; never anything else.

    PYTHONPATH=tests python tests/fuzz.py 0 3000        mutants by number; prints those that fall

One process runs many, under limits of its own. A warning counts as a traceback.
"""

import contextlib
import io
import json
import random
import re
import resource
import signal
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import psutil
import pyarrow
from pyarrow import parquet
from scene_files import EVERYTHING, FRICTION, LOAD, STAGES, lines, scene_text

import convexrough as cr
from convexrough import cli
from convexrough.errors import ConvexroughError
from convexrough.memory import MemoryRise

SECONDS, LONG_SECONDS = 20, 120  # of processor time for one mutant, and of 100 MB in one
WARRANTED = 40  # times the size of a file: what reading it may take
SPARE, AVAILABLE = 2**28, 2**29  # of memory beside that, and what the machine is said to have
MOST_ASPERITIES = 400  # scenes of more are read and not computed
LONG = 100_000_000  # of a line that is far too long

POINTS = [(0.0, 0.0), (0.0025, 0.0), (-0.0025, 0.0), (0.0, 0.003), (0.001, -0.003)]
X, Y = map(list, zip(*POINTS, strict=True))
UNITS = '[units]\nlength = "mm"\nforce = "N"\n[solver]\nname = "newton"\n'
SUMMITS = 'pattern = "file"\npath = "{}"\ntip_radius = 0.02'

#: The columns of each kind of table.
TABLES: dict[str, dict[str, list[Any]]] = {
    "summits": {"x": X, "y": Y, "height": [0.0, 1e-7, 0.0, -1e-7, 0.0]},
    "loads": {"x": X, "y": Y, "load": [2e-9] * 5},
    "forces": {"force": [1e-10] * 5, "status": ["partial"] * 5},
}

#: What a number becomes, and a word.
NUMBERS = (
    *("1e308", "-1e308", "1e400", "1e-308", "5e-324", "1e60", "1e-60", "1e61", "1e-61", "nan"),
    *("inf", "-inf", "-0.0", "0", "-1", "1", "1_000", "0x1F", "0b1", "1.", ".5", "1,5", "1d-3"),
    *("9" * 4000, "9" * 5000, "1" + "0" * 30, "2147483648", "9223372036854775808", "true"),
    *("1979-05-27", '"0.02"', "[]", "[[0.02]]", "{}", "0.02 mm", "", "1e-15", "1e15", "1e5", "7"),
    *("[0.5, 0.5]", f"[{'1e-9, ' * 2000}]", "null", "NaN"),
)
WORDS = (
    *("\0", "\x1b[31m", "\u202e", "\U0001f600", '"', "'''", "\\", "=", "../..", ",", ".", "\ud800"),
    *("/dev/null", "x" * 5000, "%s%n", "{0.__class__}", "true", "nan", "-", "none.csv"),
)


class Mutant(NamedTuple):
    """How it was made, the files of its folder, and the command."""

    how: str
    files: dict[str, bytes]
    arguments: list[str]


def mutant(seed: int) -> Mutant:
    """The one of this number."""
    rng = random.Random(seed)
    kind = ("scene", "scene", "table", "table", "arrays", "proof")[seed % 6]
    if kind == "proof":
        how, contents = _spoiled(rng, _honest_proof(), TEXTS)
        return Mutant(f"proof {how}", {"proof.json": contents}, ["check", "proof.json"])
    files = {"a.toml": _scene(rng, "summits.csv"), "summits.csv": _text(rng, "summits")}
    if kind == "scene":
        how, files["a.toml"] = _spoiled(rng, files["a.toml"], TEXTS)
        return Mutant(f"scene {how}", files, _run(rng))
    table = rng.choice(["summits", "loads", "forces"] if kind == "table" else ["summits", "loads"])
    form = "csv" if kind == "table" else rng.choice(["npy", "npz", "parquet"])
    name = f"{table}.{form}"
    made = _text(rng, table) if form == "csv" else _array_file(rng, table, form)
    how, contents = _spoiled(rng, made, TEXTS if form == "csv" else BYTES)
    if table == "summits":
        files = {"a.toml": _scene(rng, name), name: contents}
        return Mutant(f"{name} {how}", files, _run(rng))
    files |= {"loads.csv": _text(random.Random(0), "loads"), name: contents}
    arguments = ["verify", "a.toml", "loads.csv" if table == "forces" else name]
    if table == "forces":
        arguments += ["--shear", name, "--shear-force", "1e-10"]
    return Mutant(f"{name} {how}", files, [*arguments, *rng.choice([[], ["--json"], ["--proof"]])])


def _scene(rng: random.Random, summits: str) -> bytes:
    everything = EVERYTHING.replace(repr(LOAD), "1e-8")
    stages = rng.choice([FRICTION, FRICTION + STAGES, everything, UNITS + FRICTION])
    normal = rng.choice(["approach = 5e-5", "load = 1e-8"])
    return scene_text(SUMMITS.format(summits), normal, stages).encode()


def _run(rng: random.Random) -> list[str]:
    more = rng.choice([[], ["--json"], ["--proof"], ["--html"]])
    return ["run", "a.toml", "--no-figures", "--force", *more]


def _text(rng: random.Random, table: str) -> bytes:
    return lines(TABLES[table], rng.choice([",", ";", "\t", " "])).encode()


def _array_file(rng: random.Random, table: str, form: str) -> bytes:
    """Mostly as it should be; else of a type or shape that is unexpected."""
    columns, out = TABLES[table], io.BytesIO()
    if form == "parquet":
        parquet.write_table(pyarrow.table(columns), out)
    elif form == "npz":
        np.savez(out, **{name: _odd(rng, np.array(each)) for name, each in columns.items()})
    else:
        np.save(out, _odd(rng, np.array(list(columns.values())).T), allow_pickle=True)
    return out.getvalue()


def _odd(rng: random.Random, values: Any) -> Any:
    with np.errstate(all="ignore"):
        kinds = ("f2", "f4", "i8", "c16", "?", "U9", "S3", "O", ">f8")
        return rng.choice([
            *[values] * 12, *map(values.astype, kinds), values[..., None, None], values[:0],
            values * np.nan, values.ravel()[0], -values, np.asfortranarray(values),
            np.broadcast_to(np.zeros(1), (5, 1)), np.zeros(5, [("x", "f8"), ("load", "f8")]),
            np.zeros(5, "M8[s]"),
        ])  # fmt: skip


@cache
def _honest_proof() -> bytes:
    scene = cr.Scene(1.0, cr.Asperities(POINTS, 0.02), cr.Material(1.0, 0.3), 0.5, "summit")
    contact = cr.press(scene, approach=2e-5)
    proof = contact.proof(sheared=[cr.shear(contact, force=0.1 * contact.load)])
    return json.dumps(proof.document).encode()


# How they are spoiled -----------------------------------------------------------------------------

Spoil = Callable[[random.Random, bytes], bytes]


def _spoiled(rng: random.Random, contents: bytes, ways: tuple[Spoil, ...]) -> tuple[str, bytes]:
    chosen = [rng.choice(ways) for _ in range(rng.choice([1, 1, 2]))]
    for way in chosen:
        contents = way(rng, contents)
    return "+".join(way.__name__ for way in chosen), contents


def truncated(rng: random.Random, contents: bytes) -> bytes:
    return contents[: rng.randrange(len(contents) + 1)]


def some_bytes(rng: random.Random, contents: bytes) -> bytes:
    """As a disk loses them: a block that is zero, random, or of elsewhere in the file."""
    place, size = rng.randrange(len(contents) + 1), rng.choice([1, 1, 8, 64, 512])
    source = rng.randrange(len(contents) + 1)
    block = rng.choice([bytes(size), rng.randbytes(size), contents[source : source + size]])
    return contents[:place] + block + contents[place + rng.choice([0, size]) :]


def binary(rng: random.Random, contents: bytes) -> bytes:
    heads = [b"", b"PK\x03\x04", b"\x89HDF", b"\x1f\x8b\x08", b"%PDF-1.4", b"PAR1", b"\x93NUMPY"]
    return rng.choice(heads) + rng.randbytes(rng.choice([0, 1, 10, 1000, 100_000]))


def encoded(rng: random.Random, contents: bytes) -> bytes:
    """In another encoding, or with other ends of lines."""
    ends = ["\r\n", "\r", "\n\r", "\n\n", "\x0b", "\x0c", "\u0085", "\u2028", "\0"]
    codes = ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-7", "cp1252", "utf-8-sig"]
    text = contents.decode("latin-1") + rng.choice(["", "# \u00e9\u03bc", "\u2212", "\u3000"])
    text = text.replace("\n", rng.choice(ends)) if rng.random() < 0.5 else text
    return text.encode(rng.choice(codes), "replace")


def lines_moved(rng: random.Random, contents: bytes) -> bytes:
    """Lines twice, gone, or in another order."""
    lines = contents.split(b"\n")
    place, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[place], lines[other] = lines[other], rng.choice([lines[place], lines[other], b""])
    return b"\n".join(rng.choice([1, 1, 2]) * lines)


def wide(rng: random.Random, contents: bytes) -> bytes:
    """Longer lines, or a quotation that does not end."""
    end = rng.choice([b",", b";1", b"\t", b" 1.5", b'"', b'"a"b,'])
    count = rng.choice([1, 100, 20_000])
    return contents.replace(b"\n", end * count + b"\n", rng.choice([1, -1]))


def other_number(rng: random.Random, contents: bytes) -> bytes:
    return _replaced(rng, contents, rb"-?\d[\d.]*(?:e-?\d+)?", rng.choice(NUMBERS))


def other_word(rng: random.Random, contents: bytes) -> bytes:
    """Control characters, other alphabets, quotes, no characters at all."""
    return _replaced(rng, contents, rb"[A-Za-z_]{2,}", rng.choice(WORDS))


def _replaced(rng: random.Random, contents: bytes, pattern: bytes, new: str) -> bytes:
    found = list(re.finditer(pattern, contents))
    if not found:
        return contents
    place = rng.choice(found)
    inserted = new.encode("utf-8", "surrogatepass")
    return contents[: place.start()] + inserted + contents[place.end() :]


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


BYTES: tuple[Spoil, ...] = (truncated, some_bytes, some_bytes, binary)
TEXTS: tuple[Spoil, ...] = (
    *(truncated, some_bytes, binary, encoded, lines_moved, wide, deep, long_line),
    *(other_number, other_number, other_number, other_word, other_word),
)


class Hang(BaseException):
    """Too much processor time."""


# Running them -------------------------------------------------------------------------------------


def run(made: Mutant) -> tuple[int | None, str]:
    """Its status, in a folder of its own and in this process; and its fault, "" if all is well."""
    size = sum(map(len, made.files.values()))
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        for path, contents in made.files.items():
            Path(path).write_bytes(contents)
        status, said, fault = _called(made, size)
    if not fault and status == 2 and not re.search(r"(error|unreadable|Error): \S", said):
        fault = f"no reason: {said[:200]!r}"
    allowed = (0, 1, 2) if made.arguments[0] == "check" else (0, 2, 3, 4)
    if not fault and status not in allowed:
        fault = f"status {status}: {said[:200]!r}"
    if not fault and len(said) > 20_000 and "--json" not in made.arguments:
        fault = f"{len(said)} characters: {said[:200]!r}"
    return status, fault


def _called(made: Mutant, size: int) -> tuple[int | None, str, str]:
    """Status, what standard error says, and the fault."""
    out, err = io.StringIO(), io.StringIO()
    rise = MemoryRise()
    signal.setitimer(signal.ITIMER_PROF, LONG_SECONDS if size > 2**24 else SECONDS)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = 2 if _large(made, err) else cli.main(made.arguments)
    except Hang:
        return None, "", f"hangs: {traceback.format_exc().splitlines()[-3:]}"
    except BaseException:
        return None, "", "".join(traceback.format_exc().splitlines(keepends=True)[-12:])
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    risen = rise.risen() or 0
    if risen > SPARE + WARRANTED * size:
        return status, err.getvalue(), f"{risen / 2**20:.0f} MiB for {size} bytes"
    return status, err.getvalue(), ""


def _large(made: Mutant, err: io.StringIO) -> bool:
    """Whether it is a scene that would take long, as it should."""
    with contextlib.suppress(ConvexroughError):
        if made.arguments[0] != "check" and len(cr.read_scene("a.toml").scene) > MOST_ASPERITIES:
            print("error: read only, as it is large", file=err)
            return True
    return False


def limited() -> None:
    """This process from here on."""

    def too_long(*_: object) -> None:
        raise Hang

    signal.signal(signal.SIGPROF, too_long)
    warnings.simplefilter("error")
    for seed in range(6):  # what is imported, and kept, when first used
        run(mutant(seed))
    held = psutil.Process().memory_info().vms
    most = held + AVAILABLE + 2 * SPARE + 12 * LONG
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    psutil.virtual_memory = lambda: SimpleNamespace(available=AVAILABLE)  # type: ignore


if __name__ == "__main__":
    limited()
    seen: Counter[str] = Counter()
    for seed in range(int(sys.argv[1]), int(sys.argv[2])):
        status, fault = run(made := mutant(seed))
        seen[f"status {status}"] += 1
        if fault:
            print(json.dumps([seed, made.how, status, fault]), flush=True)
    print(json.dumps(seen))
