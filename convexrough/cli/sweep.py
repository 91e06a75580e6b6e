"""`sweep`: compute many scenes with local processes or Dask, or print a summary of the results."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from convexrough.cli.output import (
    DONE,
    INTERRUPTED,
    NOT_CERTIFIED,
    PATH,
    SOLVER_FAILED,
    Output,
    output_options,
    progress,
    say_aside,
    written,
)

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from convexrough.run.stage import Summary


def _part(context: Any, option: Any, value: str | None) -> tuple[int, int] | None:
    """The pair (K, N) from the text K/N, which asks for share K of N shares, counted from 1."""
    if value is None:
        return None
    k, _, n = value.partition("/")
    if not (k.isdigit() and n.isdigit() and 1 <= int(k) <= int(n)):
        raise click.BadParameter(f"{value}: expected K/N, whole numbers with K from 1 to N")
    return int(k), int(n)


@click.command()
@click.argument("sweep", type=PATH, required=False)
@click.option("--part", metavar="K/N", callback=_part,
              help="Compute the K-th of N shares of the scenes.")  # fmt: skip
@click.option("--resume", is_flag=True, help="Continue an interrupted sweep.")
@click.option("--scheduler", metavar="ADDRESS",
              help='Dask scheduler: tcp://..., a file, or "local".')  # fmt: skip
@click.option("--workers", metavar="N", type=click.IntRange(1),
              help="Number of processes; default: all cores.")  # fmt: skip
@click.option("--summary", metavar="DIR", type=PATH, help="Print quantiles of the results in DIR.")
@output_options("out", "force", "as_json")
def sweep(
    output: Output,
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
    undecided; 4 if a scene failed, or if the sweep stopped because worker processes died or had
    other versions of packages than this command; 130 if interrupted. If the command stops early,
    the rows computed so far are kept, and the same command with --resume computes the rest.
    """
    if (sweep is None) == (summary is None):
        raise click.UsageError("Either SWEEP, or --summary DIR.")
    if summary is not None:
        return _say_summary(summary, output)
    if workers is not None and scheduler is not None:
        raise click.UsageError("--workers and --scheduler exclude each other.")
    if resume and output.force:
        raise click.UsageError("--resume and --force exclude each other.")
    from convexrough.errors import WorkerError
    from convexrough.sweeps.report import cautions, describe, failures, progress_kept, summarise
    from convexrough.sweeps.sweep import read_sweep, run

    assert sweep is not None  # SWEEP or --summary is given
    folder = output.out or Path(f"{sweep.stem}-sweep")
    with progress("reading the first scene"):
        plan = read_sweep(sweep)
    try:
        with progress(str(sweep)), _executor(workers, scheduler) as executor:
            table, did = run(
                plan, executor, out=folder, resume=resume, overwrite=output.force, part=part
            )
    except KeyboardInterrupt:
        say_aside("interrupted", progress_kept(folder, plan))
        return INTERRUPTED
    except WorkerError as error:
        say_aside("error", str(error), progress_kept(folder, plan))
        return SOLVER_FAILED
    said = summarise(table, **did)
    output.say(said, describe(said), (*failures(table), *cautions(table)))
    return _status(said)


def _executor(workers: int | None, scheduler: str | None) -> AbstractContextManager[Executor]:
    from convexrough.sweeps.pool import Processes, dask

    return Processes(workers) if scheduler is None else dask(scheduler)


def _say_summary(folder: Path, output: Output) -> int:
    from convexrough.record import rows_of
    from convexrough.sweeps import report
    from convexrough.sweeps.table import open_sweep

    table = open_sweep(folder)
    with progress(f"reading {folder}"):
        said = report.summarise(table)
        found = table.quantiles(at=report.AT)
    lines = [*report.describe(said), "", *report.describe_quantiles(found)]
    if output.out is not None:
        with progress("writing results"), output.folder(output.out) as new:
            report.write_summary(new, table, found)
        lines += [*written(new), *report.figures_left_out(table)]
    output.say({**said, "quantiles": rows_of(found)}, lines)
    return _status(said)


def _status(summary: Summary) -> int:
    if summary["sweep"]["failed"]:
        return SOLVER_FAILED
    return NOT_CERTIFIED if summary["sweep"]["undecided"] else DONE
