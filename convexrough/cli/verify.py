"""`verify`: what a file of loads claims, held against what is proved."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from convexrough.cli.options import PATH, Command, json_option, proof_option
from convexrough.cli.proof import write_proof
from convexrough.cli.speech import DONE, NOT_CERTIFIED, blamed_on, progress, say_aside, written
from convexrough.errors import FileError, InputError

if TYPE_CHECKING:
    from convexrough.run.claims import Manner


def claim_options(command: Command) -> Command:
    """What `verify` is asked, and how it reads files."""
    called = "The column of load, x, y, ...: its header, or its number from 1."
    for option in (
        click.option("--junit", metavar="FILE", type=PATH, help="Write the findings for CI."),
        click.option("--out", metavar="DIR", type=PATH, help="New folder: table, JSON, figure."),
        click.option("--explain", is_flag=True, help="Only say how the files are read."),
        click.option("--force", metavar="Q", type=float, help="The shear force they carry."),
        click.option("--shear", metavar="FORCES", type=PATH, help="A file of shear forces, too."),
        click.option("--nodes", is_flag=True, help="Rows are nodes: sum them at asperities."),
        click.option("--missing-open", is_flag=True, help="Asperities without a row are open."),
        click.option("--sign", type=click.Choice(["1", "-1"]), default="1",
                     help="-1 where compression is negative."),
        click.option("--scale", metavar="NAME=FACTOR", multiple=True,
                     help="Multiply the numbers of a column."),
        click.option("--column", metavar="NAME=COLUMN", multiple=True, help=called),
        click.option("--tolerance", metavar="X", type=float,
                     help="How far positions may be off; default 1 % of the least spacing."),
        click.option("--floor", metavar="X", type=float, default=0.0,
                     help="A load up to X claims that its asperity is open."),
        click.option("--within", metavar="PART", type=float,
                     help="Loads must be proved to this part of the largest."),
    ):  # fmt: skip
        command = option(command)
    return command


def _manner(column: Sequence[str], scale: Sequence[str], sign: str, **options: Any) -> Manner:
    """How the options say that files are read."""
    from convexrough.checks import finite
    from convexrough.run.claims import Manner
    from convexrough.tabular.table import KINDS, named_columns

    names = ("load", "pressure", "area", "x", "y", "force", "status")
    factors = {}
    for each in scale:
        name, _, factor = each.partition("=")
        try:
            factors[name] = finite("--scale", float(factor))
        except ValueError as error:
            raise InputError("--scale", found=each, expected="NAME=FACTOR, a number") from error
        if name not in names or name not in KINDS or not factors[name]:
            expected = f"NAME=FACTOR, not 0, where NAME is one of {', '.join(names[:-1])}"
            raise InputError("--scale", found=each, expected=expected)
    columns: dict[str, str] = {}
    for each in column:
        name, _, called = each.partition("=")
        columns |= named_columns("--column", {name: called}, names)
    return Manner(columns=columns, scales=factors, sign=int(sign), **options)


@click.command()
@click.argument("scene", type=PATH)
@click.argument("loads", type=PATH)
@claim_options
@proof_option
@json_option
def verify(
    scene: Path,
    loads: Path,
    *,
    within: float | None,
    floor: float,
    shear: Path | None,
    force: float | None,
    explain: bool,
    out: Path | None,
    junit: Path | None,
    as_json: bool,
    proof: bool,
    **how: Any,
) -> int:
    """Hold loads that came from anywhere against what is proved.

    LOADS is a file of numbers with a column load, and x and y or an index unless in the scene's
    order: CSV and its kin, .xlsx, .mat, .npy, .npz or Parquet. It claims that asperities with a
    load touch, and no others. A column pressure, of nodes or pixels, is summed at asperities.

    Exit status: 0 only if the claimed set is proved right, every load is near enough and a
    prescribed total agrees, and the like of shear forces; 2 wrong input; 3 otherwise; 4 no shear
    state was found to compare with.
    """
    from convexrough.run import verdict_report
    from convexrough.run.report import describe
    from convexrough.run.results import claim_folder
    from convexrough.run.scene_file import read_scene
    from convexrough.run.summary import to_json
    from convexrough.run.verification import Question, read_files, verify_files

    if (shear is None) != (force is None):
        raise click.UsageError("--shear and --force go together.")
    target = (out or Path()) / "proof.json"
    for new in (*((target,) if proof else ()), *((junit,) if junit else ())):
        if new.exists():
            raise FileError(f"{new}: is there already; nothing is overwritten")
    question = Question(within=within, floor=floor, how=_manner(**how), shear=shear, force=force)
    file = read_scene(scene)
    if explain:
        read = [each for each in read_files(file, loads, question) if each is not None]
        lines = [line for each in read for line in (each.note, *each.explained, "")]
        lines += verdict_report.describe_scene(file.scene, file.units)
        click.echo(to_json({"read": lines}) if as_json else "\n".join(lines))
        return DONE
    if out is not None:
        if out.is_dir() and any(out.iterdir()):
            raise FileError(f"{out}: not empty; --out takes another")
        claim_folder(out, force=False)
    with progress(f"judging the loads of {len(file.scene):,} asperities"):
        found = verify_files(file, loads, question)
    summary = verdict_report.verdict_summary(found)
    lines = verdict_report.describe_verdict(found, file.units)
    lines += [
        "",
        "the loads as given, by themselves",
        *describe(summary, length_unit=file.units.length, force_unit=file.units.force),
    ]
    if out is not None:
        with progress("writing results"):
            files = verdict_report.write_verdict(out, summary, found, file.units)
        lines += written(out, files)
    click.echo(to_json(summary) if as_json else "\n".join(lines))
    if junit is not None:
        verdict_report.write_junit(junit, found)
    for hint in found.verdict.hints(file.units.force or "N"):
        say_aside("hint", hint)
    if not found.holds:
        say_aside("warning", f"not certified: {verdict_report.reason(found)}")
    status = DONE if found.holds else NOT_CERTIFIED
    if not proof:
        return status
    from convexrough.proof import prove

    verdict = found.verdict
    claimed = [
        load if touches else 0.0
        for load, touches in zip(verdict.loads, verdict.claimed, strict=True)
    ]
    control: Any = {"approach": file.approach, "load": file.load}
    work = partial(prove, file.scene, claimed, **control)
    with blamed_on(scene):
        return write_proof(target, lambda show: work(announce=show), as_json) or status
