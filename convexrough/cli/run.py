"""`run`, and `new`, which writes a scene to run."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click

from convexrough.cli.options import PATH, html_option, output_options, proof_option
from convexrough.cli.proof import write_proof
from convexrough.cli.speech import DONE, blamed_on, progress, say, say_aside, written
from convexrough.errors import FileError
from convexrough.whole import replacing


@click.command()
@click.argument("scene", type=PATH)
@proof_option
@html_option
@output_options
def run(
    scene: Path,
    out: Path | None,
    no_figures: bool,
    force: bool,
    as_json: bool,
    html: bool,
    proof: bool,
) -> int:
    """Press and shear the scene of a TOML file; write tables, certificate and figures.

    Results go to the folder SCENE-results unless --out names another.
    """
    from convexrough import checks
    from convexrough.contact import solve
    from convexrough.run.results import claim_folder, write_results
    from convexrough.run.scene_file import read_scene
    from convexrough.run.stages import compute
    from convexrough.run.summary import summarise

    file = read_scene(scene)
    if html:
        with blamed_on(scene):
            checks.friction(file.scene.friction)
    if proof:
        from convexrough.proof import refuse_many

        with blamed_on(scene):
            refuse_many(file.scene)
    folder = out or Path(f"{scene.stem}-results")
    stale = claim_folder(folder, force=force)
    pressing = f"pressing {len(file.scene):,} asperities"
    with blamed_on(scene), progress(pressing) as show:
        contact = solve(
            file.problem(), file.solver, announce=lambda news: show(f"{pressing}: {news}")
        )
    with blamed_on(scene), progress("shearing") as show:
        found = compute(contact, file, announce=lambda news: show(f"shearing: {news}"))
    with progress("writing results") as show:
        summary = summarise(found)
        files = write_results(
            folder,
            found,
            summary,
            figures=not no_figures,
            html=html,
            units=file.units,
            source=file,
            announce=lambda news: show(f"writing results: {news}"),
        )
    for path in stale:
        if path not in files:
            say_aside("warning", f"{path}: of an earlier run, left as it was changed since")
    status = say(summary, as_json, written(folder, files), file.units)
    if not proof:
        return status
    from convexrough.run.proving import prove_findings

    work = partial(prove_findings, found)
    return write_proof(folder / "proof.json", lambda show: work(announce=show), as_json) or status


@click.command()
@click.argument("scene", type=PATH)
def new(scene: Path) -> int:
    """Write a commented scene to start from."""
    from importlib.resources import files

    template = files("convexrough.run").joinpath("new_scene.toml").read_text(encoding="utf-8")
    if scene.exists() or scene.is_symlink():
        raise FileError(f"{scene}: is there already, and stays as it is; name another file")
    with replacing(scene) as temporary:
        temporary.write_text(template, encoding="utf-8")
    click.echo(f"written  {scene}")
    return DONE
