"""Commands: `run` computes a scene file, `new` writes one, and `check` checks a proof file."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import click

from convexrough.atomic import replacing
from convexrough.cli.output import (
    DONE,
    OPTIONS,
    PATH,
    Output,
    output_options,
    progress,
    say_aside,
    written,
)
from convexrough.errors import FileError, blamed_on


@click.command()
@click.argument("scene", type=PATH)
@output_options(*OPTIONS)
def run(output: Output, scene: Path) -> int:
    """Compute a scene; write tables, certificate and figures.

    Results of a.toml go to the folder a-results unless --out names another. --html needs a scene
    with a sphere and friction. If the file has a table [sweep], the command does the same as
    `convexrough sweep`.
    """
    from convexrough import checks
    from convexrough.run.results import origin, prove_results, slider_page
    from convexrough.run.scene_file import has_sweep, read_scene

    if has_sweep(scene):
        return _swept(scene, output)
    file = read_scene(scene)
    with blamed_on(scene):
        if output.html:
            checks.friction(file.scene.friction)
        if output.proof:
            from convexrough.proof import refuse_many

            refuse_many(file.scene)
    folder = output.folder(Path(f"{scene.stem}-results"), reads=file.inputs, **origin(file))
    with folder as new:
        with blamed_on(scene), progress(f"pressing {len(file.scene):,} asperities"):
            contact = file.press()
        for caution in file.cautions(contact):  # before work that may be long, or fail
            say_aside("warning", caution)
        with blamed_on(scene), progress("computing"):
            results = file.compute(contact)
            page = slider_page(results[0]) if output.html else None
            new.results(results, figures=not output.no_figures)
            new.text("scene.toml", file.text)
            if page is not None:
                new.text("slider.html", page)
        prove = partial(prove_results, results, partial(say_aside, "warning"))
        proof = output.proved(prove, new.path)
    status = output.say_results(results, written(new))
    return output.say_proof(proof, new.folder, status)


def _swept(sweep: Path, output: Output) -> int:
    from convexrough.cli.sweep import sweep as command

    if output.html or output.proof:
        raise click.UsageError("--proof and --html are options of one scene, not of a sweep.")
    own = {"out": output.out, "force": output.force, "as_json": output.as_json}
    status: int = click.get_current_context().invoke(command, sweep=sweep, **own)
    return status


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


@click.command()
@click.argument("proof", type=PATH)
def check(proof: Path) -> int:
    """Check the claims of a proof file, in exact arithmetic.

    PROOF is a file that `run --proof` or `verify --proof` wrote. It claims bounds on loads and
    losses, and statuses of asperities. Exit status: 0 if all claims are proved; 1 if the proof is
    refused, with the reason; 2 if the file is unreadable. The checker is one file of the package,
    checker.py, which needs only Python: python checker.py PROOF does the same.
    """
    from convexrough import checker

    return checker.main([str(proof)])
