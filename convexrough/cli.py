"""The command line: what each command reads, calls, writes and says, and its exit status.

What is slow to import is imported by the command that needs it, when it runs.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.shell_completion import shell_complete

from convexrough.errors import ConvexroughError, FileError, InputError, ProofError, SolverError
from convexrough.version import __version__

if TYPE_CHECKING:
    from convexrough.proof import Proof
    from convexrough.run.scene_file import UnitNames
    from convexrough.run.summary import Summary

DONE, UNHEARD, WRONG_INPUT, NOT_CERTIFIED, SOLVER_FAILED, INTERRUPTED = 0, 1, 2, 3, 4, 130

#: What a shell sets that wants a script for completion, or the completions of a line.
COMPLETE = "_CONVEXROUGH_COMPLETE"

Command = TypeVar("Command", bound=Callable[..., Any])
_PATH = click.Path(path_type=Path)
_proof = click.option("--proof", is_flag=True, help="Write proof.json, for anybody to check.")
_html = click.option("--html", is_flag=True, help="Write slider.html: a page to move the force.")
_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object, no text.")


def _output(command: Command) -> Command:
    """The options of every command that writes a folder of results."""
    for option in (
        _json,
        click.option("--force", is_flag=True, help="Replace results in a folder in use."),
        click.option("--no-figures", is_flag=True, help="Write no PNG and SVG."),
        click.option("--out", metavar="DIR", type=_PATH, help="Folder for results."),
    ):
        command = option(command)
    return command


def _claim_options(command: Command) -> Command:
    """What `verify` is asked, and how it reads files."""
    part = "Loads must be proved to this part of the largest."
    floor = "A load up to X claims that its asperity is open."
    apart = "How far positions may be off; default 1 % of the least spacing."
    called = "The column of load, x, y, force or status: its header, or its number from 1."
    for option in (
        click.option("--out", metavar="DIR", type=_PATH, help="New folder: table, JSON, figure."),
        click.option("--force", metavar="Q", type=float, help="The shear force they carry."),
        click.option("--shear", metavar="FORCES", type=_PATH, help="A file of shear forces, too."),
        click.option("--column", metavar="NAME=COLUMN", multiple=True, help=called),
        click.option("--tolerance", metavar="X", type=float, help=apart),
        click.option("--floor", metavar="X", type=float, default=0.0, help=floor),
        click.option("--within", metavar="PART", type=float, help=part),
    ):
        command = option(command)
    return command


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="convexrough")
def program() -> None:
    """Rough frictional contact, with a proof of which asperities touch.

    Exit status: 0 done and certified; 1 standard output closed or full; 2 wrong input; 3 done, not
    certified; 4 a solver failed; 130 interrupted.
    """


@program.command()
@click.argument("scene", type=_PATH)
@_proof
@_html
@_output
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
        with _blamed_on(scene):
            checks.friction(file.scene.friction)
    if proof:
        from convexrough.proof import refuse_many

        with _blamed_on(scene):
            refuse_many(file.scene)
    folder = out or Path(f"{scene.stem}-results")
    stale = claim_folder(folder, force=force)
    pressing = f"pressing {len(file.scene):,} asperities"
    with _blamed_on(scene), _progress(pressing) as show:
        contact = solve(
            file.problem(), file.solver, announce=lambda news: show(f"{pressing}: {news}")
        )
    with _blamed_on(scene), _progress("shearing") as show:
        found = compute(contact, file, announce=lambda news: show(f"shearing: {news}"))
    with _progress("writing results") as show:
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
            _say_aside("warning", f"{path}: of an earlier run, left as it was changed since")
    status = _say(summary, as_json, _written(folder, files), file.units)
    if not proof:
        return status
    from convexrough.run.proving import prove_findings

    work = partial(prove_findings, found)
    return _prove(folder / "proof.json", lambda show: work(announce=show), as_json) or status


@program.command()
@click.argument("scene", type=_PATH)
@click.argument("loads", type=_PATH)
@_claim_options
@_proof
@_json
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
    with _progress(f"judging the loads of {len(file.scene):,} asperities"):
        found = verify_files(file, loads, question)
    summary = verdict_report.verdict_summary(found)
    length, force = file.units
    lines = verdict_report.describe_verdict(found, file.units)
    lines += ["", "the loads as given", *describe(summary, length_unit=length, force_unit=force)]
    if out is not None:
        with _progress("writing results"):
            files = verdict_report.write_verdict(out, summary, found, file.units)
        lines += _written(out, files)
    click.echo(to_json(summary) if as_json else "\n".join(lines))
    for hint in verdict_report.hints(found, file.units):
        _say_aside("hint", hint)
    if not found.holds:
        _say_aside("warning", f"not certified: {verdict_report.reason(found)}")
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
    with _blamed_on(scene):
        return _prove(target, lambda show: work(announce=show), as_json) or status


@program.command()
@click.argument("proof", type=_PATH)
def check(proof: Path) -> int:
    """Check a proof in exact arithmetic, believing nothing in the file.

    Exit status: 0 all that it claims is proved; 1 refused, with the reason; 2 unreadable. The
    checker is one file that needs Python only: python checker.py PROOF does the same.
    """
    from convexrough import checker

    return checker.main([str(proof)])


@program.command()
@click.argument("scene", type=_PATH)
@_json
def compare(scene: Path, as_json: bool) -> int:
    """Run every formulation and solver on one scene: agreement, certificate, time.

    The cone program also goes through SCS and QOCO, where they are installed.

    Exit status 3 also where a solver refuses the scene, or where two certified answers exclude each
    other: that would be a mistake in the mathematics.
    """
    from convexrough.compare import compare as compare_solvers
    from convexrough.run.report import comparison_warnings, describe_comparison
    from convexrough.run.scene_file import read_scene
    from convexrough.run.summary import comparison_summary, to_json

    file = read_scene(scene)
    with _blamed_on(scene), _progress(f"pressing on {len(file.scene)} asperities") as show:
        comparison = compare_solvers(
            file.scene,
            approach=file.approach,
            load=file.load,
            announce=lambda name: show(f"pressing on {len(file.scene)} asperities: {name}"),
        )
    summary = comparison_summary(comparison)
    if as_json:
        click.echo(to_json(summary))
    else:
        length, force = file.units
        click.echo("\n".join(describe_comparison(summary, length_unit=length, force_unit=force)))
    for warning in comparison_warnings(summary):
        _say_aside("warning", warning)
    outcomes = {entry.outcome for entry in comparison.entries}
    if "failed" in outcomes and not comparison.contradictions:
        return SOLVER_FAILED
    if comparison.contradictions or "refused" in outcomes or not comparison.certified:
        return NOT_CERTIFIED
    return DONE


@program.command()
@click.argument("scene", type=_PATH)
def new(scene: Path) -> int:
    """Write a commented scene to start from."""
    from importlib.resources import files

    template = files("convexrough.run").joinpath("new_scene.toml").read_text(encoding="utf-8")
    try:
        with scene.open("x", encoding="utf-8") as file:
            file.write(template)
    except OSError as error:
        raise FileError(f"{scene}: cannot be written: {error.strerror or error}") from error
    click.echo(f"written  {scene}")
    return DONE


@program.command()
@_html
@_output
def paper(out: Path | None, no_figures: bool, force: bool, as_json: bool, html: bool) -> int:
    """Reproduce the source paper's example (Dini and Hills 2009)."""
    from convexrough.paper import example
    from convexrough.paper.figure_data import figure_data
    from convexrough.run import results
    from convexrough.run.summary import summarise

    folder = out or Path("paper-results")
    results.claim_folder(folder, force=force)
    with _progress("reproducing the paper"):
        found = example.findings()
        comparison = example.compare(found)
        summary = summarise(found) | {"paper": comparison}
        files = results.write_tables(folder, figure_data(found.contact))
        if not no_figures:
            from convexrough.paper.figures import paper_figures

            files += results.write_figures(folder, paper_figures(found.contact))
        files += results.write_results(folder, found, summary, figures=False, html=html)
    lines = ["", *example.table(comparison), *_written(folder, files)]
    return _say(summary, as_json, lines)


@program.command()
@_output
@click.option("--quick", is_flag=True, help="Fewer and smaller sizes: less than a minute.")
@click.option("--page", metavar="FILE", type=_PATH, help="A Markdown page to renew, too.")
def bench(
    out: Path | None, no_figures: bool, force: bool, as_json: bool, quick: bool, page: Path | None
) -> int:
    """Speed against error: every solver, many sizes, the true error of each answer.

    Results go to the folder bench-results unless --out names another. With --page, the tables also
    go between the markers of that page, and the figures into the folder figures beside it.
    """
    from convexrough.bench import suite
    from convexrough.bench.files import write_bench
    from convexrough.bench.page import describe, split_page
    from convexrough.bench.plan import full_plan, quick_plan
    from convexrough.bench.summary import summarise
    from convexrough.run.results import claim_folder
    from convexrough.run.summary import to_json

    if page is not None:
        split_page(page)  # a page without markers is refused before anything is computed
    folder = out or Path("bench-results")
    claim_folder(folder, force=force)
    plan = quick_plan() if quick else full_plan()
    with _progress("measuring") as show:
        found = suite.run(plan, announce=show)
        files = write_bench(folder, found, figures=not no_figures, page=page)
    lines = [to_json(summarise(found))] if as_json else describe(found)
    click.echo("\n".join(lines if as_json else [*lines, *_written(folder, files)]))
    return DONE


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status; errors are a message, never a traceback."""
    try:
        if arguments is None and (asked := os.environ.get(COMPLETE)):
            return shell_complete(program, {}, "convexrough", COMPLETE, asked)
        given = sys.argv[1:] if arguments is None else list(arguments)
        with program.make_context("convexrough", given) as context:
            status = int(program.invoke(context) or DONE)
        if sys.stdout is not None:  # it is None where a shell closed it
            sys.stdout.flush()
        return status
    except click.exceptions.Exit as end:
        return end.exit_code
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (click.Abort, KeyboardInterrupt):
        _say_aside("interrupted")
        return INTERRUPTED
    except ConvexroughError as error:
        for line in str(error).splitlines():
            _say_aside("error", line)
        return SOLVER_FAILED if isinstance(error, SolverError) else WRONG_INPUT
    except OSError as error:  # those of files are FileErrors
        return _unheard(error)


def _unheard(error: OSError) -> int:
    """Nobody reads standard output any more, or it is full; results are written all the same."""
    if error.errno != errno.EPIPE:
        _say_aside("error", f"standard output: {error.strerror or error}")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)  # so that what is left is not written when the interpreter ends
    os.close(nowhere)
    return UNHEARD


def _prove(path: Path, work: Callable[[Callable[[str], object]], Proof], as_json: bool) -> int:
    """Write a proof; NOT_CERTIFIED where there is none."""
    try:
        with _progress("proving") as show:
            proof = work(lambda news: show(f"proving: {news}"))
    except ProofError as error:
        _say_aside("warning", str(error))
        return NOT_CERTIFIED
    proof.save(path)
    click.echo(f"{proof.proved}\nwritten  {path}", err=as_json)
    return DONE


def _written(folder: Path, files: Sequence[Path]) -> list[str]:
    return ["", f"written to {folder}: {', '.join(path.name for path in files)}"]


def _say(
    summary: Summary, as_json: bool, lines: Sequence[str] = (), units: UnitNames | None = None
) -> int:
    """Print the summary, then `lines`, and return the exit status that it deserves."""
    from convexrough.run.report import describe, warnings
    from convexrough.run.summary import proved, to_json

    length, force = units or ("", "")
    if as_json:
        click.echo(to_json(summary))
    else:
        described = describe(summary, length_unit=length, force_unit=force)
        click.echo("\n".join([*described, *lines]))
    for warning in warnings(summary, length_unit=length, force_unit=force):
        _say_aside("warning", warning)
    return DONE if proved(summary) else NOT_CERTIFIED


def _say_aside(*parts: str) -> None:
    click.echo(": ".join(("convexrough", *parts)), err=True)


@contextmanager
def _blamed_on(path: Path) -> Iterator[None]:
    """Mistakes that show only in computing, with the file named."""
    try:
        yield
    except InputError as error:
        raise error.within(str(path)) from error


@contextmanager
def _progress(message: str) -> Iterator[Callable[[str], object]]:
    """A moving line on standard error while the body runs, if that is a terminal.

    Yields what changes the message.
    """
    if not sys.stderr.isatty():
        yield lambda message: None
        return
    from rich.console import Console

    with Console(stderr=True).status(message) as status:
        yield status.update
