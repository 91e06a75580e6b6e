"""`verify`: what a file of loads claims, held against what is proved."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import click

from convexrough.cli.options import PATH, Command, json_option, proof_option
from convexrough.cli.proof import write_proof
from convexrough.cli.speech import DONE, NOT_CERTIFIED, blamed_on, progress, say_aside, written
from convexrough.errors import FileError


def claim_options(command: Command) -> Command:
    """What `verify` is asked, and how it reads files."""
    part = "Loads must be proved to this part of the largest."
    floor = "A load up to X claims that its asperity is open."
    apart = "How far positions may be off; default 1 % of the least spacing."
    called = "The column of load, x, y, force or status: its header, or its number from 1."
    for option in (
        click.option("--out", metavar="DIR", type=PATH, help="New folder: table, JSON, figure."),
        click.option("--force", metavar="Q", type=float, help="The shear force they carry."),
        click.option("--shear", metavar="FORCES", type=PATH, help="A file of shear forces, too."),
        click.option("--column", metavar="NAME=COLUMN", multiple=True, help=called),
        click.option("--tolerance", metavar="X", type=float, help=apart),
        click.option("--floor", metavar="X", type=float, default=0.0, help=floor),
        click.option("--within", metavar="PART", type=float, help=part),
    ):
        command = option(command)
    return command


@click.command()
@click.argument("scene", type=PATH)
@click.argument("loads", type=PATH)
@claim_options
@proof_option
@json_option
def verify(
    scene: Path, loads: Path, out: Path | None, as_json: bool, proof: bool, **options: Any
) -> int:
    """Hold loads that came from anywhere against what is proved.

    LOADS is a file of numbers with a column load, and x and y unless in the scene's order: CSV and
    its kin, .npy, .npz or Parquet. It claims that asperities with a load touch, and no others.

    Exit status: 0 only if the claimed set is proved right, every load is near enough and a
    prescribed total agrees, and the like of shear forces; 2 wrong input; 3 otherwise; 4 no shear
    state was found to compare with.
    """
    from convexrough.run import verdict_report
    from convexrough.run.report import describe
    from convexrough.run.results import claim_folder
    from convexrough.run.scene_file import read_scene
    from convexrough.run.summary import to_json
    from convexrough.run.verification import Question, named_columns, verify_files

    if (options["shear"] is None) != (options["force"] is None):
        raise click.UsageError("--shear and --force go together.")
    target = (out or Path()) / "proof.json"
    if proof and target.exists():
        raise FileError(f"{target}: is there already; nothing is overwritten")
    question = Question(columns=named_columns(options.pop("column")), **options)
    file = read_scene(scene)
    if out is not None:
        if out.is_dir() and any(out.iterdir()):
            raise FileError(f"{out}: not empty; --out takes another")
        claim_folder(out, force=False)
    with progress(f"judging the loads of {len(file.scene):,} asperities"):
        found = verify_files(file, loads, question)
    summary = verdict_report.verdict_summary(found)
    length, force = file.units
    lines = verdict_report.describe_verdict(found, file.units)
    lines += [
        "",
        "the loads as given, by themselves",
        *describe(summary, length_unit=length, force_unit=force),
    ]
    if out is not None:
        with progress("writing results"):
            files = verdict_report.write_verdict(out, summary, found, file.units)
        lines += written(out, files)
    click.echo(to_json(summary) if as_json else "\n".join(lines))
    for hint in verdict_report.hints(found, file.units):
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
