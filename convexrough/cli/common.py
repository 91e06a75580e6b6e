"""Options, printed output and exit statuses of the commands."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, redirect_stdout
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from convexrough.errors import ProofError

if TYPE_CHECKING:
    from convexrough.proof import Proof
    from convexrough.run.results import Writer
    from convexrough.run.stage import Result

DONE, UNHEARD, WRONG_INPUT, NOT_CERTIFIED, SOLVER_FAILED, INTERRUPTED = 0, 1, 2, 3, 4, 130

PATH = click.Path(path_type=Path)

Decorator = Callable[[Callable[..., int]], Callable[..., int]]


def option(usage: str, text: str, kind: Any = None, *, name: str = "", **more: Any) -> Decorator:
    """A decorator that adds an option, with a usage such as "--load P"; without a value in it and a
    kind, it is a flag. `name` is that of the argument, if not that in the usage."""
    flag, _, value = usage.partition(" ")
    names = (flag, name) if name else (flag,)
    how: dict[str, Any] = {"is_flag": True} if kind is None and not value else {"type": kind}
    return click.option(*names, help=text, metavar=value or None, **how, **more)


def _formats(*given: Any) -> tuple[str, ...]:
    """The value of --formats as a tuple: `given` is a context, an option and its text."""
    formats = tuple(dict.fromkeys(each.strip().lower() for each in given[-1].split(",")))
    if unknown := [each for each in formats if each not in ("png", "svg", "pdf")]:
        raise click.BadParameter(f"found {unknown[0]!r}, expected png, svg, pdf")
    return formats


def _from_here(*given: Any) -> Any:
    """The solvers of --solver. This call makes modules of the current folder importable."""
    if given[-1] and "" not in sys.path:
        sys.path.insert(0, "")
    return given[-1]


solver_option = option(
    "--solver NAME", "A solver of the package, or the import path of your class, such as "
    "mine.Solver; may be repeated.", name="solvers", multiple=True, callback=_from_here
)  # fmt: skip

#: The options for the place and the form of results, in the order of the help.
OPTIONS = {
    "proof": option("--proof", "Write proof.json, which `convexrough check` verifies. It is a "
                    "proof about the solution, not about given loads."),
    "html": option("--html", "Also write slider.html, an interactive page."),
    "formats": option("--formats LIST", "Formats of figures: png, svg, pdf.",
                      default="png", show_default=True, callback=_formats),
    "dpi": option("--dpi", "Pixels per inch of figures.",
                  click.IntRange(50, 600), default=200, show_default=True),
    "out": option("--out DIR", "Folder for the results.", PATH),
    "no_figures": option("--no-figures", "Do not write figures."),
    "force": option("--force", "Replace the files of an earlier run."),
    "as_json": option("--json", "Print one JSON object instead of text.", name="as_json"),
}  # fmt: skip


def output_options(*names: str) -> Decorator:
    """A decorator that adds these `OPTIONS`; the first argument of the command is an `Output`."""

    def add(command: Callable[..., int]) -> Callable[..., int]:
        @wraps(command)
        def called(**given: Any) -> int:
            own = {name: given.pop(name) for name in names}
            return command(Output(**own), **given)

        added: Callable[..., int] = called
        for name in reversed(names):
            added = OPTIONS[name](added)
        return added

    return add


@dataclass
class Output:
    """The values of the `OPTIONS`, with methods that write and print results accordingly."""

    proof: bool = False
    html: bool = False
    out: Path | None = None
    force: bool = False
    as_json: bool = False
    no_figures: bool = False
    formats: Sequence[str] = ("png",)
    dpi: int = 200

    def folder(self, default: Path, **given: Any) -> AbstractContextManager[Writer]:
        """The folder --out, or else `default`; further arguments as for `results_folder`."""
        from convexrough.run.results import results_folder

        given |= {"force": self.force, "formats": self.formats, "dpi": self.dpi}
        given["command"] = click.get_current_context().info_name
        return results_folder(self.out or default, **given)

    def say(
        self, summary: dict[str, Any], lines: Iterable[str], warnings: Iterable[str] = ()
    ) -> None:
        """Print the summary as a JSON object, or the lines; and warnings on standard error."""
        from convexrough.atomic import to_json

        click.echo(to_json(summary) if self.as_json else "\n".join(lines))
        for warning in warnings:
            say_aside("warning", warning)

    def say_results(
        self,
        results: Sequence[Result],
        lines: Sequence[str] = (),
        more: dict[str, Any] | None = None,
    ) -> int:
        """Print the summary with `more`, or results and `lines`; return the exit status."""
        from convexrough.run.results import summarise

        first, *others = (result.lines() for result in results)
        lines = [*first, *(line for each in others for line in ("", *each)), *lines]
        warnings = (it for result in results for it in (*result.doubts(), *result.cautions()))
        self.say(summarise(results) | (more or {}), lines, warnings)
        return DONE if all(result.certified for result in results) else NOT_CERTIFIED

    def proved(self, work: Callable[[], Proof], folder: Path) -> Proof | None:
        """The proof, also written to `folder`; None, with a warning, if there is none."""
        if not self.proof:
            return None
        try:
            with progress("proving"):
                found = work()
        except ProofError as error:
            say_aside("warning", f"proof.json is not written: {error}")
            return None
        found.save(folder / "proof.json")
        return found

    def say_proof(self, proof: Proof | None, folder: Path, status: int, about: str = "") -> int:
        """Print what is proved, and what the file is `about`; return `status`, but NOT_CERTIFIED if
        --proof finds no proof."""
        if proof is not None:
            click.echo(f"{proof.proved}\nwritten  {folder / 'proof.json'}{about}", err=self.as_json)
        return NOT_CERTIFIED if self.proof and proof is None else status


def written(new: Writer) -> list[str]:
    """A line with the names of the files in a folder of results."""
    place = "here" if new.folder == Path() else f"to {new.folder}"
    return ["", f"written {place}: {', '.join(path.name for path in new.files)}"]


def say_aside(*parts: str) -> None:
    click.echo(": ".join(("convexrough", *parts)), err=True)


@contextmanager
def progress(message: str) -> Iterator[None]:
    """Show a line on a terminal, with records of our logger, while the body of `with` runs. What
    the body prints, such as a user's solver, and records of level NOTE go to standard error."""
    from convexrough.progress import NOTE, logged

    with ExitStack() as stack:
        stack.enter_context(logged(lambda record: say_aside("note", record.getMessage()), NOTE))
        # Standard error is None where a shell closed it.
        aside = sys.stderr or stack.enter_context(open(os.devnull, "w"))
        stack.enter_context(redirect_stdout(aside))
        if sys.stderr is not None and sys.stderr.isatty():
            from rich.console import Console

            line = stack.enter_context(Console(stderr=True).status(message))
            told = logged(lambda record: line.update(f"{message}: {record.getMessage()}"))
            stack.enter_context(told)
        yield
