"""The commands `compare`, `export`, `gallery` and `bench`, about solvers; and `paper`."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli import common
from convexrough.errors import FileError, blamed_on


@click.command()
@click.argument("scene", type=common.PATH)
@common.solver_option
@common.option("--within PART", "Largest difference allowed between a load and that of Newton's "
               "method, as a fraction of the largest load.",
               click.FloatRange(0, min_open=True), default=1e-3, show_default=True)  # fmt: skip
@common.option("--log FILE", "Write the iterations of Newton's method and Clarabel to a CSV file.",
               common.PATH)  # fmt: skip
@common.output_options("as_json")
def compare(
    output: common.Output, scene: Path, solvers: tuple[str, ...], within: float, log: Path | None
) -> int:
    """Solve a scene with all solvers; compare loads, proofs, times.

    All solvers of the package are compared with Newton's method, and so are SCS and QOCO, which
    solve a cone program, if they are installed. With --solver, only the named solvers are compared.

    Exit status: 2 if the input is wrong; 3 if certified results contradict each other, a mistake of
    this package; else 4 if a solver failed; 3 if no result is certified, if a load differs by more
    than --within, or if a solver does not accept the scene; else 0.
    """
    from convexrough.comparison import compare as compare_solvers
    from convexrough.comparison import solver_named
    from convexrough.run import comparison as report
    from convexrough.run.results import write_rows
    from convexrough.run.scene_file import read_scene

    with common.progress("importing solvers"):
        chosen = [solver_named(name) for name in solvers] or None
    if log is not None and log.exists():
        raise FileError(f"{log}: exists already; name another file")
    file = read_scene(scene)
    with blamed_on(scene), common.progress(f"pressing on {len(file.scene)} asperities"):
        comparison = compare_solvers(
            file.scene,
            approach=file.approach,
            load=file.load,
            influence=file.influence,
            solvers=chosen,
            log=log is not None,
        )
    if log is not None:
        write_rows(log, report.steps(comparison))
    summary = report.comparison_summary(comparison, within)
    lines = report.describe_comparison(summary, file.scene.units)
    output.say(summary, lines, report.comparison_warnings(summary))
    outcomes = {entry.outcome for entry in comparison.entries}
    if "failed" in outcomes and not comparison.contradictions:
        return common.SOLVER_FAILED
    wrong = comparison.contradictions or summary["disagreeing"] or "refused" in outcomes
    return common.NOT_CERTIFIED if wrong or not comparison.certified else common.DONE


@click.command()
@click.argument("scene", type=common.PATH)
@common.option("--format", "Write only this format; may be repeated.",
               click.Choice(("cbf", "json", "mps", "npz")), name="formats", multiple=True
               )  # fmt: skip
@common.option("--bristles M", "Bristles per asperity in the quadratic program (HiGHS is slow "
               "above 16).", click.IntRange(1), default=64, show_default=True)  # fmt: skip
@common.output_options("out", "force", "as_json")
def export(output: common.Output, scene: Path, formats: tuple[str, ...], bristles: int) -> int:
    """Write a scene as cone and quadratic programs for other solvers.

    The cone program of the contact law and its dual are written as cbf, json (Clarabel) and npz,
    the quadratic program of bristles (springs that approximate Hertz's law) as mps and npz
    (qpsolvers). For each program, index.json gives the minimum of the objective, units and the
    indices of the asperities. The folder is SCENE-programs unless --out names another.
    """
    from convexrough.programs.program import write_programs
    from convexrough.run.scene_file import read_scene

    file = read_scene(scene)
    writing = common.progress(f"writing programs of {len(file.scene):,} asperities")
    folder = output.folder(Path(f"{scene.stem}-programs"), reads=file.inputs)
    with folder as new, blamed_on(scene), writing:
        index = write_programs(
            new.text,
            scene.stem,
            file.scene,
            approach=file.approach,
            load=file.load,
            formats=formats,
            bristles=bristles,
        )
    lines = [
        f"{name}: {about['form']}, {about['variables']:,} variables, least objective "
        f"{about['objective']:.12g}"
        for name, about in index["programs"].items()
    ]
    left_out = (f"{name}: left out: {reason}" for name, reason in index["left_out"].items())
    output.say(index, [*lines, *common.written(new)], left_out)
    return common.DONE


@click.command()
@common.option("--export DIR", "Folder for programs and answers.", common.PATH)
@common.option("--profile", "Time every solver and check its solutions.")
@common.solver_option
@click.argument("names", nargs=-1)
@common.output_options("force", "as_json")
def gallery(
    output: common.Output,
    export: Path | None,
    profile: bool,
    solvers: tuple[str, ...],
    names: tuple[str, ...],
) -> int:
    """List, export or time hard scenes with 50-digit answers.

    NAMES are names of cases or of families of cases; default: all. --export writes each case as a
    quadratic program (.npz for qpsolvers) and as a cone program (JSON for Clarabel, and CBF), with
    an index. --profile prints how many solutions of each solver are right to 0.1 % of the largest
    load, and its times; --solver limits it to Newton's method and the named solvers. With --solver
    the exit status is 4 if a solver failed, else 3 if loads are wrong.
    """
    from convexrough import gallery as wing
    from convexrough.comparison import solver_named
    from convexrough.gallery.export import exported
    from convexrough.tabular.columns import aligned

    if export is not None and (profile or solvers):
        raise click.UsageError("--export excludes --profile and --solver.")
    wanted = wing.names(*names)
    if profile or solvers:
        from convexrough.bench.profile import profile_of

        with common.progress("timing"):
            found = profile_of([solver_named(each) for each in solvers] or None, cases=wanted)
        heads = [head for head in found[0] if head != "outcomes"]
        table = [[row[head] for head in heads] for row in found]
        cells = [[f"{x:.0%}" if isinstance(x, float) else x for x in row] for row in table]
        output.say({"profile": found}, aligned([heads, *cells], left=1))
        if solvers and any(row["failed"] for row in found):
            return common.SOLVER_FAILED
        wrong = solvers and any(row["wrong"] for row in found)
        return common.NOT_CERTIFIED if wrong else common.DONE
    cases = [wing.case(name) for name in wanted]
    heads = ["case", "family", "what is hard", "asperities", "touching"]
    rows = [[it.name, it.family, it.why, len(it), it.touching.sum()] for it in cases]
    lines = aligned([heads, *rows], left=3)
    summary = {case.name: {"family": case.family, "why": case.why} for case in cases}
    if export is not None:
        with output.folder(export) as new, common.progress("writing"):
            for name, text in exported(wanted):
                new.text(name, text)
        lines = [f"{len(wanted)} cases, {len(new.files)} files, written to {export}"]
    output.say({"cases": summary}, lines)
    return common.DONE


@click.command()
@common.output_options("out", "no_figures", "force", "as_json")
@common.option("--quick", "Use fewer and smaller scenes.")
@common.option("--page FILE", "Also update this Markdown page.", common.PATH)
def bench(output: common.Output, quick: bool, page: Path | None) -> int:
    """Measure time and error of solvers for many scene sizes.

    Results go to the folder bench-results unless --out names another. With --page, the command also
    replaces the text of FILE between the markers "bench: begin" and "bench: end", and its figures.
    """
    from convexrough.bench import rows, suite

    if page is not None:
        rows.split_page(page)  # a page without markers is refused before anything is computed
    with output.folder(Path("bench-results")) as new, common.progress("measuring"):
        found = suite.run(quick=quick)
        suite.write_bench(new, found, figures=not output.no_figures, page=page)
    output.say(found.summary(), [*rows.describe(found), *common.written(new)])
    return common.DONE


@click.command()
@common.output_options(*(name for name in common.OPTIONS if name != "proof"))
def paper(output: common.Output) -> int:
    """Reproduce the example of Dini and Hills (2009).

    Tables and figures go to the folder paper-results unless --out names another.
    """
    from convexrough.paper import example
    from convexrough.paper.example import PaperStates
    from convexrough.paper.figures import figure_data, paper_figures
    from convexrough.plots.slider import slider_html

    with output.folder(Path("paper-results")) as new, common.progress("reproducing the paper"):
        found = example.results()
        states = PaperStates(found[0].contact)
        comparison = example.compare(states)
        new.tables(figure_data(states))
        if not output.no_figures:
            new.figures(paper_figures(states))
        if output.html:
            new.text("slider.html", slider_html(states.contact, found[0].lines()))
        more = {"paper": comparison}
        new.results(found, figures=False, more=more)
    return output.say_results(found, ["", *example.table(comparison), *common.written(new)], more)
