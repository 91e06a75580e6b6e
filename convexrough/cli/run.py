"""Commands about scene files and proof files: `run`, `sweep`, `new` and `check`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import click

from convexrough.atomic import remove_unfinished, write_text
from convexrough.cli import common
from convexrough.errors import FileError, WorkerError, blamed_on


@click.command()
@click.argument("scene", type=common.PATH)
@common.output_options(*common.OPTIONS)
def run(output: common.Output, scene: Path) -> int:
    """Compute a scene; print what is proved; write tables and figures.

    Results of a.toml go to the folder a-results unless --out names another. --html needs a scene
    with a sphere and friction. A file with a table [sweep] is computed as by `convexrough sweep`.
    """
    from convexrough import checks
    from convexrough.plots.slider import slider_html
    from convexrough.run.results import copied, origin, prove_results
    from convexrough.run.scene_file import has_sweep, read_scene

    if has_sweep(scene):
        if output.html or output.proof:
            raise click.UsageError("--proof and --html are options of one scene, not of a sweep.")
        return _swept(scene, output)
    with common.progress(f"reading {scene}"):
        file = read_scene(scene)
    with blamed_on(scene):
        if output.html:
            checks.friction(file.scene.friction)
        if output.proof:
            from convexrough.proof import refuse_many

            refuse_many(file.scene)
    folder = output.folder(Path(f"{scene.stem}-results"), reads=file.inputs, **origin(file))
    with folder as new:
        with blamed_on(scene), common.progress(f"pressing {len(file.scene):,} asperities"):
            contact = file.press()
        for caution in file.cautions(contact):  # before computations that may be long, or fail
            common.say_aside("warning", caution)
        with blamed_on(scene), common.progress("computing"):
            results = file.compute(contact)
            page = slider_html(contact, results[0].lines()) if output.html else None
            new.results(results, figures=not output.no_figures)
            new.text("scene.toml", copied(file))
            if page is not None:
                new.text("slider.html", page)
        prove = partial(prove_results, results, partial(common.say_aside, "warning"))
        proof = output.proved(prove, new.path)
    status = output.say_results(results, common.written(new))
    return output.say_proof(proof, new.folder, status)


def _part(context: Any, option: Any, value: str | None) -> tuple[int, int] | None:
    """The numbers (K, N) in the text K/N; None without a text."""
    if value is None:
        return None
    k, _, n = value.partition("/")
    if not (k.isdigit() and n.isdigit() and 1 <= int(k) <= int(n)):
        raise click.BadParameter(f"{value}: expected K/N, whole numbers with K from 1 to N")
    return int(k), int(n)


@click.command()
@click.argument("sweep", type=common.PATH, required=False)
@common.option("--part K/N", "Compute the K-th of N shares of the scenes.", callback=_part)
@common.option("--resume", "Continue an interrupted sweep.")
@common.option("--scheduler ADDRESS", 'Dask scheduler: tcp://..., a file, or "local".')
@common.option("--workers N", "Number of processes; default: all cores.", click.IntRange(1))
@common.option("--summary DIR", "Print quantiles of the results in DIR.", common.PATH)
@common.output_options("out", "force", "as_json")
def sweep(
    output: common.Output,
    sweep: Path | None,
    summary: Path | None,
    workers: int | None,
    scheduler: str | None,
    resume: bool,
    part: tuple[int, int] | None,
) -> int:
    """Compute every scene of SWEEP, a scene file with a table [sweep].

    Results go to a folder named after the file (rough.toml: rough-sweep) unless --out names
    another. With --summary DIR in place of SWEEP the command computes no scenes, but prints
    quantiles of the results in the folder DIR; with --out it also writes them, and figures.

    Exit status: 0 if all computed scenes are certified; 2 if the input is wrong; 3 if a scene is
    undecided; 4 if a scene failed or workers died; 130 if interrupted. If the command stops early,
    the rows computed so far are kept, and the same command with --resume computes the rest.
    """
    if (sweep is None) == (summary is None):
        raise click.UsageError("Give either SWEEP or --summary DIR.")
    if summary is not None:
        return _say_summary(summary, output)
    if workers is not None and scheduler is not None:
        raise click.UsageError("--workers and --scheduler exclude each other.")
    if resume and output.force:
        raise click.UsageError("--resume and --force exclude each other.")
    assert sweep is not None  # SWEEP or --summary is given
    return _swept(sweep, output, workers, scheduler, resume=resume, part=part)


def _swept(
    sweep: Path,
    output: common.Output,
    workers: int | None = None,
    scheduler: str | None = None,
    **options: Any,
) -> int:
    from convexrough.sweeps.plan import plan_of
    from convexrough.sweeps.report import cautions, describe, incomplete, progress_kept, summarise
    from convexrough.sweeps.sweep import Processes, dask, run

    folder = output.out or Path(f"{sweep.stem}-sweep")
    with common.progress("reading the first scene"):
        plan = plan_of(sweep)
    try:
        pool = Processes(workers) if scheduler is None else dask(scheduler)
        with common.progress(str(sweep)), pool as executor:
            table, did = run(plan, executor, out=folder, overwrite=output.force, **options)
    except KeyboardInterrupt:
        common.say_aside("interrupted", progress_kept(folder))
        return common.INTERRUPTED
    except WorkerError as error:
        common.say_aside("error", str(error), progress_kept(folder))
        return common.SOLVER_FAILED
    said = summarise(table, **did)
    output.say(said, [*describe(said), *incomplete(said)], [*cautions(table)])
    return _status(said)


def _say_summary(folder: Path, output: common.Output) -> int:
    from convexrough.record import rows_of
    from convexrough.sweeps import report
    from convexrough.sweeps.table import open_sweep

    table = open_sweep(folder)
    with common.progress(f"reading {folder}"):
        said = report.summarise(table)
        found = table.quantiles(at=report.AT)
    lines = [*report.describe(said), "", *report.describe_quantiles(found)]
    if output.out is not None:
        counts = {name: said["sweep"][name] for name in ("scenes", "rows")}
        with common.progress("writing results"), output.folder(output.out, **counts) as new:
            report.write_summary(new, table, found)
        lines += common.written(new)
    warnings = [*report.incomplete(said), *report.cautions(table)]
    output.say({**said, "quantiles": rows_of(found)}, lines, warnings)
    return _status(said)


def _status(summary: dict[str, Any]) -> int:
    if summary["sweep"]["failed"]:
        return common.SOLVER_FAILED
    return common.NOT_CERTIFIED if summary["sweep"]["undecided"] else common.DONE


@click.command()
@click.argument("scene", type=common.PATH)
def new(scene: Path) -> int:
    """Write an example of a scene file, with comments.

    SCENE is the name of the new file; a file of this name must not exist.
    """
    from importlib.resources import files

    template = files("convexrough.run").joinpath("new_scene.toml").read_text(encoding="utf-8")
    if scene.exists() or scene.is_symlink():
        raise FileError(f"{scene}: exists already; name another file")
    write_text(scene, template)
    remove_unfinished(scene.parent)
    click.echo(f"written  {scene}")
    return common.DONE


@click.command()
@click.argument("proof", type=common.PATH)
def check(proof: Path) -> int:
    """Check the claims of a proof file, in exact arithmetic.

    PROOF is a file that `run --proof` or `verify --proof` wrote. Exit status: 0 if all claims are
    proved; 1 if a claim is not proved, and the reason is printed; 2 if the file is unreadable.
    `python checker.py PROOF` does the same; this file of the package needs only Python.
    """
    from convexrough import checker

    return checker.main([str(proof)])
