"""`verify`: check contact loads from another code."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from convexrough.atomic import write_text
from convexrough.cli import common
from convexrough.errors import FileError, InputError, ProofError, blamed_on, file_errors

if TYPE_CHECKING:
    from convexrough.arrays import Array
    from convexrough.normal.claims import Claim
    from convexrough.proof import Proof
    from convexrough.run.scene_file import SceneFile
    from convexrough.verdict.claims import Manner


def _manner(column: Sequence[str], scale: Sequence[str], sign: str, **options: Any) -> Manner:
    from convexrough.checks import finite
    from convexrough.tabular.roles import named_columns
    from convexrough.verdict.claims import Manner

    numbers = ("load", "pressure", "area", "x", "y", "force")
    factors = {}
    for name, factor in _pairs("--scale", scale).items():
        with suppress(ValueError):
            factors[name] = finite("--scale", float(factor))
        if name not in numbers or not factors.get(name):
            expected = f"NAME=FACTOR, a number but 0, where NAME is one of {', '.join(numbers)}"
            raise InputError("--scale", found=f"{name}={factor}", expected=expected)
    columns = named_columns("--column", _pairs("--column", column), (*numbers, "status", "index"))
    return Manner(columns=columns, scales=factors, sign=int(sign), **options)


def _pairs(option: str, given: Sequence[str]) -> dict[str, str]:
    """The parts before and after the equals sign of each value of an option."""
    pairs: dict[str, str] = {}
    for each in given:
        name, _, value = each.partition("=")
        if name in pairs:
            raise InputError(option, found=f"{name} twice", expected=f"one {option} {name}")
        pairs[name] = value
    return pairs


@click.command()
@click.argument("scene", type=common.PATH)
@click.argument("loads", type=common.PATH)
@common.option("--within PART", "Largest error allowed of a load or shear force, as a fraction of "
               "the largest one. If their sum is prescribed, its error counts as a fraction of it.",
               float, default=0.01, show_default=True)  # fmt: skip
@common.option("--floor X", "Count loads from -X to X, in the scene's unit of force, as 0: their "
               "asperities are claimed to be open.", float, default=0.0, show_default=True
               )  # fmt: skip
@common.option("--tolerance X", "Largest distance of a position in the file from its asperity; "
               "default 1 % of the smallest distance of two asperities.", float)  # fmt: skip
@common.option("--column NAME=COLUMN", "Read NAME (load, x, index, ...) from this column: a "
               "header, or a number from 1.", multiple=True)  # fmt: skip
@common.option("--scale NAME=FACTOR", "Multiply the numbers of the column NAME by FACTOR.",
               multiple=True)  # fmt: skip
@common.option("--sign", "Use -1 if compression is negative in the file.",
               click.Choice(["1", "-1"]), default="1")  # fmt: skip
@common.option("--missing-open", "Asperities without a row are claimed to be open.")
@common.option("--nodes", "Rows are nodes; sum their forces by asperity.")
@common.option("--shear FORCES", "Also check the shear forces in this file, after the total shear "
               "force has grown from 0 to the Q of --shear-force.", common.PATH)  # fmt: skip
@common.option("--shear-force Q", "Prescribed sum of the forces in FORCES.", float)
@common.option("--explain", "Report how the files are read, and stop.")
@common.option("--junit FILE", "Write the findings as JUnit XML.", common.PATH)
@common.output_options("proof", "out", "force", "as_json")
def verify(
    output: common.Output,
    scene: Path,
    loads: Path,
    *,
    within: float,
    shear: Path | None,
    shear_force: float | None,
    explain: bool,
    junit: Path | None,
    **how: Any,
) -> int:
    """Check contact loads from another code.

    LOADS is a table with a column load: text (CSV, TSV, ...), .xlsx, .mat, .npy, .npz or Parquet.
    Columns x and y, or an index, assign each row to an asperity; without them the rows are in the
    order of the scene. An asperity with a positive load is claimed to touch; an asperity with the
    load 0 is claimed to be open. If there is a column pressure and no column load, rows are nodes
    or pixels of a regular grid, whose pressures times areas (column area) are summed by asperity.
    With --out the command writes a table, a figure and verdict.json.

    Exit status: 0 if it is proved that exactly the claimed asperities touch (with --shear also that
    exactly the claimed ones slide), and that no error exceeds --within; 2 if the input is wrong; 3
    if this is not proved, or if --proof finds no proof; 4 if the shear problem could not be solved.
    """
    import numpy as np

    from convexrough.plausibility import cautions_about
    from convexrough.run.results import headed
    from convexrough.run.scene_file import read_scene
    from convexrough.run.stages.normal import describe, judged_loads
    from convexrough.verdict import report
    from convexrough.verdict.claims import judged, read_forces

    if (shear is None) != (shear_force is None):
        raise click.UsageError("--shear and --shear-force go together.")
    if explain and (output.out or junit or output.proof):
        raise click.UsageError("--explain checks nothing: leave out --out, --junit and --proof.")
    if junit and junit.suffix.lower() != ".xml":  # with --force it could be a table of the scene
        raise FileError(f"--junit {junit}: expected a name that ends in .xml")
    alone = [Path("proof.json")] if output.proof and output.out is None else []
    for each in [*alone, *([junit] if junit else [])]:
        if each.resolve() in {it.resolve() for it in (scene, loads, shear) if it}:
            raise FileError(f"{each}: an input; name another file")
        if each.exists() and not output.force:
            raise FileError(f"{each}: exists already; --force replaces it")
        with file_errors(each, "be written"):
            each.unlink(missing_ok=True)  # an earlier proof must not remain if this run fails
    with common.progress(f"reading {scene}"):
        file = read_scene(scene)
    manner = _manner(units=file.scene.units, convert=file.convert, **how)
    files = {"load": loads, **({"force": shear} if shear is not None else {})}
    read = [read_forces(path, file.scene, manner, name) for name, path in files.items()]
    if unread := manner.scales.keys() - {name for each in read for name in each.numbers}:
        found = ", ".join(f"{name}={manner.scales[name]:.15g}" for name in sorted(unread))
        known = ", ".join({name: "" for each in read for name in each.numbers})
        raise InputError("--scale", found=found, expected=f"a column that is read: {known}")
    about = report.describe_scene(file.scene)
    if explain:
        lines = [line for each in read for line in (f"{each.path}:", *each.explained, "")]
        output.say({"read": [*lines, *about]}, [*lines, *about])
        return common.DONE
    inputs = [*file.inputs, *files.values()]
    with output.folder(output.out, reads=inputs) if output.out else nullcontext() as new:
        with common.progress(f"checking the loads of {len(file.scene):,} asperities"):
            with blamed_on(scene):
                problem = file.problem()
            total = shear_force or 0.0
            claims = judged(problem, *read, within=within, floor=manner.floor, force=total)
        of_loads = claims[0]
        normal = judged_loads(of_loads.certificate, of_loads.values)
        summary = headed(normal=normal) | report.verdict_summary(claims)
        claimed = np.where(of_loads.claimed, of_loads.values, 0.0)
        if new is not None:
            from convexrough.plots.verdict import verdict_figures  # imports matplotlib

            new.summary("verdict.json", summary)
            new.tables({"verdict": report.asperity_columns(claims)})
            new.figures(verdict_figures(*claims))
        prove = partial(_proof, file, claimed, of_loads, scene)
        proof = output.proved(prove, new.path if new else Path())
    if junit is not None:
        names = " ".join(map(str, filter(None, (scene, loads, shear))))
        write_text(junit, report.junit(claims, names))
    lines = [*(each.note for each in read), *about]
    for claim in claims:
        lines += ["", *report.describe_claim(claim, ": --json and --out list all")]
    scaled = of_loads.total_prescribed not in (None, of_loads.total_given)
    scaling = "; gaps and energy after scaling them to the prescribed total" if scaled else ""
    lines += ["", f"certificate of the given loads{scaling}", *describe(normal, file.scene.units)]
    lines += common.written(new) if new else []
    output.say(summary, lines)
    for hint in (hint for claim in claims for hint in claim.hints()):
        common.say_aside("hint", hint)
    found = of_loads.solution
    pressed = (claimed, of_loads.certificate) if found is None else (found.loads, found)
    for caution in cautions_about(file.scene, pressed[0], pressed[1].approach):
        common.say_aside("warning", caution)
    status = common.DONE
    if not all(claim.holds for claim in claims):
        status, reasons = common.NOT_CERTIFIED, filter(None, map(report.reason, claims))
        common.say_aside("warning", f"not certified: {', '.join(reasons)}")
    of_solution = ", a proof about the loads of the solution, not about the given ones"
    return output.say_proof(proof, output.out or Path(), status, of_solution)


def _proof(file: SceneFile, loads: Array, claim: Claim, scene: Path) -> Proof:
    """The proof that starts from the solution near claimed loads, which must hold."""
    from convexrough.contact import solve
    from convexrough.proof import prove

    if not claim.holds:
        said = "the given loads are not accepted; `convexrough run --proof` starts from a solution"
        raise ProofError(said)
    with blamed_on(scene):  # claimed loads may be too inaccurate for an exact proof
        solution = solve(file.problem(), start=loads).loads
        return prove(file.scene, solution, approach=file.approach, load=file.load)
