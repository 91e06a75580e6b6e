"""`run`, which computes a scene file, and `new`, which writes one."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from convexrough.atomic import replacing, write_text
from convexrough.cli.options import PATH, figure_options, html_option, output_options, proof_option
from convexrough.cli.proof import proved
from convexrough.cli.speech import DONE, NOT_CERTIFIED, progress, say, say_aside, written
from convexrough.errors import FileError, blamed_on

if TYPE_CHECKING:
    from convexrough.proof import Proof
    from convexrough.run.stage import Result


@click.command()
@click.argument("scene", type=PATH)
@proof_option
@html_option
@figure_options
@output_options
def run(
    scene: Path,
    out: Path | None,
    no_figures: bool,
    force: bool,
    as_json: bool,
    html: bool,
    proof: bool,
    formats: tuple[str, ...],
    dpi: int,
) -> int:
    """Compute a scene; write tables, certificate and figures.

    Results of a.toml go to the folder a-results unless --out names another. --html needs a scene
    with a sphere and friction. If the file has a table [sweep], the command does the same as
    `convexrough sweep`.
    """
    from convexrough import checks
    from convexrough.run.results import origin, results_folder, slider_page, write_results
    from convexrough.run.scene_file import has_sweep, read_scene

    if has_sweep(scene):
        return _swept(scene, out, force, as_json, given=html or proof)
    file = read_scene(scene)
    with blamed_on(scene):
        if html:
            checks.friction(file.scene.friction)
        if proof:
            from convexrough.proof import refuse_many

            refuse_many(file.scene)
    folder = out or Path(f"{scene.stem}-results")
    with results_folder(folder, force=force, reads=file.inputs, **origin(file)) as new:
        with blamed_on(scene), progress(f"pressing {len(file.scene):,} asperities"):
            contact = file.press()
        for caution in file.cautions(contact):  # before work that may be long, or fail
            say_aside("warning", caution)
        with blamed_on(scene), progress("computing"):
            results = file.compute(contact)
            for result in results:
                result.prepare(figures=not no_figures)
            page = slider_page(results[0]) if html else ""
        evidence = _proved(results) if proof else None
        with progress("writing results"):
            saved: dict[str, Any] = {"formats": formats, "dpi": dpi}
            files = write_results(new, results, figures=not no_figures, **saved)
            files.append(write_text(new / "scene.toml", file.text))
            if html:
                files.append(write_text(new / "slider.html", page))
            if evidence is not None:
                evidence.save(new / "proof.json")
    status = say(results, as_json, written(folder, files))
    if evidence is not None:
        click.echo(f"{evidence.proved}\nwritten  {folder / 'proof.json'}", err=as_json)
    return NOT_CERTIFIED if proof and evidence is None else status


def _swept(sweep: Path, out: Path | None, force: bool, as_json: bool, *, given: bool) -> int:
    from convexrough.cli.sweep import sweep as command

    if given:
        raise click.UsageError("--proof and --html are options of one scene, not of a sweep.")
    options: dict[str, Any] = dict(sweep=sweep, out=out, as_json=as_json, force=force)
    status: int = click.get_current_context().invoke(command, **options)
    return status


def _proved(results: list[Result]) -> Proof | None:
    from convexrough.run.proving import prove_results

    return proved(partial(prove_results, results))


@click.command()
@click.argument("scene", type=PATH)
def new(scene: Path) -> int:
    """Write an example of a scene file, with comments.

    SCENE is the name of the new file; a file of this name must not exist.
    """
    from importlib.resources import files

    template = files("convexrough.run").joinpath("new_scene.toml").read_text(encoding="utf-8")
    if scene.exists() or scene.is_symlink():
        raise FileError(f"{scene}: exists already; name another file")
    with replacing(scene) as temporary:
        temporary.write_text(template, encoding="utf-8")
    click.echo(f"written  {scene}")
    return DONE
