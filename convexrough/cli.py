"""The command line. Nothing is computed here; every command imports what it needs when it runs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from convexrough.errors import ConvexroughError, FileError, InputError, ProofError, SolverError
from convexrough.version import __version__

if TYPE_CHECKING:
    from convexrough.proof import Proof
    from convexrough.run.report import Summary
    from convexrough.run.scene_file import UnitNames
    from convexrough.run.stages import Outcome

DONE, WRONG_INPUT, NOT_CERTIFIED, SOLVER_FAILED, INTERRUPTED = 0, 2, 3, 4, 130

NEW_SCENE = """\
# A rough sphere pressed on a half-space. Any consistent units; convexrough run THIS-FILE

[sphere]
radius = 1.0

[material]
contact_modulus = 1.0        # E* = E / (2 (1 - nu^2)); or youngs_modulus = ... (one of the two)
poisson_ratio = 0.3

[asperities]
pattern = "hexagonal"        # "hexagonal", "square", or "file"
spacing = 0.0025
tip_radius = 0.02            # a number; or a list as long as the asperities
# within = 0.0102            # keep asperities this near to the axis; default: all that could touch
# height_std = 1e-6          # random heights (normal distribution) ...
# tip_radius_cv = 0.1        # ... and tip radii (lognormal, this coefficient of variation)
# seed = 7                   # required when either is given
geometry = "summit"          # or "closest": touch where the undeformed surfaces are closest

# Asperities from a file instead, with columns x, y and optionally height, tip_radius:
# pattern = "file"
# path = "summits.csv"       # relative to this file

[normal]
approach = 5e-5              # or load = ... (one of the two)

# [units]                    # names for printed results and figures; nothing is converted
# length = "m"
# force = "N"

[friction]                   # the three tables below need it; leave out what you do not want
coefficient = 0.5

[shear]                      # monotonic shear
fractions = [0.1, 0.37, 0.5]             # of f P

[cycle]                      # steady cycles
maximum = [0.1, 0.37, 0.5]               # of f P
# minimum = [0.0, 0.1, 0.2]              # default: the negative of maximum

[history]                    # any sequence of shear forces, from 0
fractions = [0.6, -0.2, 0.3, -0.6, 0.6]  # of f P

# [solver]
# name = "newton"            # or "conic", "conic_cvxpy", "bristles"
# influence = "lattice"      # or "dense", "scattered"; default: the cheapest that is exact
"""

Command = TypeVar("Command", bound=Callable[..., Any])
_PATH = click.Path(path_type=Path)
_proof = click.option("--proof", is_flag=True, help="Write proof.json, for anybody to check.")
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


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="convexrough")
def program() -> None:
    """Rough frictional contact, with a proof of which asperities touch.

    Exit status: 0 done and certified; 2 wrong input; 3 done, not certified; 4 a solver failed.
    """


@program.command()
@click.argument("scene", type=_PATH)
@_proof
@_output
def run(
    scene: Path, out: Path | None, no_figures: bool, force: bool, as_json: bool, proof: bool
) -> int:
    """Press and shear the scene of a TOML file; write tables, certificate and figures.

    Results go to the folder SCENE-results unless --out names another.
    """
    from convexrough.contact import press
    from convexrough.run.results import claim_folder
    from convexrough.run.scene_file import read_scene
    from convexrough.run.stages import compute

    file = read_scene(scene)
    if proof:
        from convexrough.proof import refuse_many

        with _blamed_on(scene):
            refuse_many(file.scene)
    folder = out or Path(f"{scene.stem}-results")
    claim_folder(folder, force=force)
    pressing = f"pressing {len(file.scene):,} asperities"
    with _blamed_on(scene), _progress(pressing) as show:
        contact = press(
            file.scene,
            approach=file.approach,
            load=file.load,
            solver=file.solver,
            influence=file.influence,
            announce=lambda news: show(f"{pressing}: {news}"),
        )
    with _blamed_on(scene), _progress("shearing") as show:
        outcome = compute(
            contact,
            shear_at=file.shear,
            cycle_between=file.cycle,
            history_of=file.history,
            announce=lambda news: show(f"shearing: {news}"),
        )
    status = _finish(folder, outcome, file.units, not no_figures, as_json)
    if not proof:
        return status
    from convexrough.run.proving import prove_outcome

    return (
        _prove(folder / "proof.json", lambda show: prove_outcome(outcome, show), as_json) or status
    )


@program.command()
@click.argument("scene", type=_PATH)
@click.argument("loads", type=_PATH)
@_proof
@_json
def verify(scene: Path, loads: Path, as_json: bool, proof: bool) -> int:
    """Certify loads that came from anywhere.

    LOADS is a CSV file with a column load, and x and y unless in the scene's order.
    """
    from convexrough.normal.certificate import certify
    from convexrough.run.report import certificate_summary
    from convexrough.run.scene_file import read_scene
    from convexrough.run.tables import read_loads

    proof_path = Path("proof.json")
    if proof and proof_path.exists():
        raise FileError(f"{proof_path}: is there already; nothing is overwritten")
    file = read_scene(scene)
    values = read_loads(loads, file.scene)
    with _blamed_on(loads), _progress(f"judging the loads of {len(values)} asperities"):
        certificate = certify(file.scene, values, approach=file.approach, load=file.load)
    summary = certificate_summary(certificate, values)
    status = _say(summary, as_json, units=file.units)
    if not proof:
        return status
    from convexrough.proof import prove

    control: Any = {"approach": file.approach, "load": file.load}
    work = partial(prove, file.scene, values, **control)
    with _blamed_on(scene):
        return _prove(proof_path, lambda show: work(announce=show), as_json) or status


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

    Exit status 3 also where a solver refuses the scene, or where two certified answers exclude each
    other: that would be a mistake in the mathematics.
    """
    from convexrough.compare import compare as compare_solvers
    from convexrough.run.report import (
        comparison_summary,
        comparison_warnings,
        describe_comparison,
        to_json,
    )
    from convexrough.run.scene_file import read_scene

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
    try:
        with scene.open("x", encoding="utf-8") as file:
            file.write(NEW_SCENE)
    except OSError as error:
        raise FileError(f"{scene}: cannot be written: {error.strerror or error}") from error
    click.echo(f"written  {scene}")
    return DONE


@program.command()
@_output
def paper(out: Path | None, no_figures: bool, force: bool, as_json: bool) -> int:
    """Reproduce the source paper's example (Dini and Hills 2009)."""
    from convexrough.paper import example
    from convexrough.run import report, results

    folder = out or Path("paper-results")
    results.claim_folder(folder, force=force)
    with _progress("reproducing the paper"):
        outcome = example.outcome()
        comparison = example.compare(outcome)
        summary = report.summarise(outcome) | {"paper": comparison}
        files = results.write_tables(folder, example.figure_data(outcome.contact))
        if not no_figures:
            from convexrough.paper.figures import paper_figures

            files += results.write_figures(folder, paper_figures(outcome.contact))
        files += results.write_results(folder, outcome, summary, figures=False)
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
    from convexrough import bench as benching
    from convexrough.run.report import to_json
    from convexrough.run.results import claim_folder

    if page is not None:
        benching.split_page(page)  # a page without markers is refused before anything is computed
    folder = out or Path("bench-results")
    claim_folder(folder, force=force)
    plan = benching.quick_plan() if quick else benching.full_plan()
    with _progress("measuring") as show:
        found = benching.run(plan, announce=show)
        files = benching.write_bench(folder, found, figures=not no_figures, page=page)
    lines = [to_json(benching.summarise(found))] if as_json else benching.describe(found)
    click.echo("\n".join(lines if as_json else [*lines, *_written(folder, files)]))
    return DONE


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status; errors are a message, never a traceback."""
    try:
        return int(program.main(arguments, prog_name="convexrough", standalone_mode=False) or DONE)
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (click.Abort, KeyboardInterrupt):
        return INTERRUPTED
    except ConvexroughError as error:
        for line in str(error).splitlines():
            _say_aside("error", line)
        return SOLVER_FAILED if isinstance(error, SolverError) else WRONG_INPUT


def _finish(folder: Path, outcome: Outcome, units: UnitNames, figures: bool, as_json: bool) -> int:
    """Write and say the results of a run."""
    from convexrough.run.report import summarise
    from convexrough.run.results import write_results

    summary = summarise(outcome)
    with _progress("writing results"):
        files = write_results(folder, outcome, summary, figures=figures, units=units)
    return _say(summary, as_json, _written(folder, files), units)


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
    from convexrough.run.report import describe, proved, to_json, warnings

    if as_json:
        click.echo(to_json(summary))
    else:
        length, force = units or ("", "")
        described = describe(summary, length_unit=length, force_unit=force)
        click.echo("\n".join([*described, *lines]))
    for warning in warnings(summary):
        _say_aside("warning", warning)
    return DONE if proved(summary) else NOT_CERTIFIED


def _say_aside(kind: str, message: str) -> None:
    click.echo(f"convexrough: {kind}: {message}", err=True)


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
