"""Comparison of all solvers on one scene: agreement, certificate and time.

The same code certifies all results, whichever solver found them. If a certified result contradicts
a result of global scope, there is a mistake in the mathematics or in the code of the package. Two
results of local scope may differ without a mistake, because they may be about different solutions.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from itertools import combinations, count
from pathlib import Path
from traceback import extract_tb
from typing import Any, Literal, NamedTuple

import numpy as np

from convexrough import checks, solvers
from convexrough.arrays import Array
from convexrough.contact import Contact, press
from convexrough.errors import InputError, SolverError
from convexrough.influence import Kind
from convexrough.memory import MemoryRise
from convexrough.normal.certificate import Certificate
from convexrough.plottable import Plottable
from convexrough.progress import LOGGER, logged_steps
from convexrough.record import LINE, Record, Table, Variables, in_text
from convexrough.scene.asperities import Asperities
from convexrough.scene.material import Material
from convexrough.scene.scene import Scene
from convexrough.solvers import named

#: A message names at most this many asperities, and gives the number of the others.
MOST_NAMED = 5

#: Two solutions differ in a contact if the load of an asperity is above this fraction of the
#: reference's largest load in one of them, and below a tenth of this fraction in the other.
CARRIES = 1e-6

#: Solvers that CVXPY can call if the packages with these names are installed.
THROUGH_CVXPY = ("SCS", "QOCO")


@dataclass(frozen=True, eq=False, repr=False)
class Entry(Record):
    """The result of one solver.

    outcome : "answered", "refused" (the solver does not accept the scene) or "failed"
    message : the reason if there is no solution, else ""
    contact : the solution with its certificate; None if there is no solution
    disagreement : largest |load - load of the reference|, divided by the reference's largest load
    different_statuses : number of asperities whose status differs from that in the reference;
        "undecided" counts as a status
    different_contacts : number of asperities whose load is above 1e-6 of the reference's largest
        load in one of the two solutions, and below 1e-7 of it in the other
    steps : for each iteration its solver, step, objective and residual, if `compare` was called
        with `log`; OSQP and the solvers of CVXPY do not report their iterations
    memory : [bytes] largest increase of the resident memory of the process, without memory that the
        allocator reused; None if there is no solution, or if the system is not Linux

    The reference is Newton's method. If it or this solver has no solution, `disagreement` is nan,
    and the two numbers of asperities are None.
    """

    solver: str
    outcome: Literal["answered", "refused", "failed"]
    message: str = ""
    contact: Contact | None = None
    disagreement: float = np.nan
    different_statuses: int | None = None
    different_contacts: int | None = None
    memory: int | None = None
    steps: tuple[Mapping[str, Any], ...] = ()


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Table, Plottable):
    """The entries of all solvers. The first is that of Newton's method, the reference.

    contradictions : a sentence for each contradiction between two certified results, at least one
        of global scope; each shows a mistake in the mathematics or in the code of the package

    >>> found = cr.compare(scene, approach=5e-5, solvers=["conic"])
    >>> len(found.contacts), found.certified, found.disagreeing(within=1e-9)
    (2, True, {})
    """

    entries: tuple[Entry, ...]
    contradictions: tuple[str, ...]

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The solutions, in the order of their entries."""
        return tuple(entry.contact for entry in self.entries if entry.contact is not None)

    @property
    def certified(self) -> bool:
        """True if at least one solver's loads prove the status of every asperity."""
        return any(contact.certificate.all_proved for contact in self.contacts)

    def disagreeing(self, within: float) -> dict[str, float]:
        """The values of `disagreement` that exceed `within`, by the name of the solver.

        Raises InputError unless `within` is positive.
        """
        within = checks.positive("within", within)
        return {it.solver: it.disagreement for it in self.entries if it.disagreement > within}

    def _rows(self) -> Iterator[tuple[str, str]]:
        for entry in self.entries:
            if (found := entry.contact) is None:
                yield entry.solver, f"{entry.outcome}: {entry.message}"[:LINE]
            else:
                proved = f"{found.certificate.scope}; {in_text(found.status)}"
                yield entry.solver, f"{proved}; {found.seconds:.2g} s"
        yield "contradictions", "; ".join(self.contradictions) or "none"

    def _variables(self) -> Variables:
        """Columns with a row for each entry; nan or "" if it has no solution."""
        none = np.full(len(self.contacts[0].scene), np.nan) if self.contacts else np.empty(0)
        answers = [entry.contact for entry in self.entries]
        statuses = [entry.different_statuses for entry in self.entries]
        columns = {
            "solver": [entry.solver for entry in self.entries],
            "outcome": [entry.outcome for entry in self.entries],
            "message": [entry.message for entry in self.entries],
            "scope": ["" if each is None else each.certificate.scope for each in answers],
            "seconds": [np.nan if each is None else each.seconds for each in answers],
            "iterations": [np.nan if each is None else each.iterations for each in answers],
            "disagreement": [entry.disagreement for entry in self.entries],
            "different_statuses": [np.nan if each is None else each for each in statuses],
        }
        loads = np.array([none if each is None else each.loads for each in answers])
        return {name: (("entry",), np.array(column)) for name, column in columns.items()} | {
            "loads": (("entry", "asperity"), loads)
        }


def compare(
    scene: Scene,
    *,
    approach: float | None = None,
    load: float | None = None,
    solvers: Sequence[solvers.Solver | str] | None = None,
    influence: Kind | None = None,
    log: bool = False,
) -> Comparison:
    """Compare the results of solvers for one normal contact.

    approach [length] or load [force] : the prescribed quantity, exactly one
    solvers  : solvers or their names; default `every_solver()`. Newton's method is always added as
        the first, the reference
    influence : compliance operator, as for `press`
    log : True to store the steps of each solver in its entry

    Raises InputError if the reference does not accept the scene. Errors of the other solvers are
    reported in their entries.

    >>> found = cr.compare(scene, approach=5e-5, solvers=["conic"])
    >>> [entry.outcome for entry in found.entries], found.contradictions
    (['answered', 'answered'], ())
    """
    others = every_solver() if solvers is None else [*map(named, solvers)]
    pressed = partial(press, scene, approach=approach, load=load, influence=influence)
    two = Asperities([[0.0, 0.0], [1.0, 0.0]], tip_radii=1.0)
    small = Scene(1e3, two, Material(contact_modulus=1.0, poisson_ratio=0.3))
    entries: list[Entry] = []
    for solver in (_REFERENCE, *(each for each in others if each != _REFERENCE)):
        LOGGER.info(solver.name)
        with suppress(Exception, SystemExit):  # imports by the solver are not timed
            press(small, approach=1e-2, solver=solver)
        kept: AbstractContextManager[Sequence[Any]] = logged_steps() if log else nullcontext(())
        with kept as steps:
            entry = _enter(solver, pressed)
        name, taken = entry.solver, [each.solver for each in entries]
        numbered = (f"{name} ({k})" if k > 1 else name for k in count(1))
        name = next(each for each in numbered if each not in taken)
        entry = replace(_against(entry, [*entries, entry][0]), solver=name, steps=tuple(steps))
        entries.append(entry)
    answers = [
        Answer(each.solver, each.contact.loads, each.contact.certificate)
        for each in entries
        if each.contact is not None
    ]
    contradicting = tuple(
        sentence
        for pair in combinations(answers, 2)
        if any(answer.certificate.scope == "global" for answer in pair)
        for sentence in contradictions(*pair)
    )
    return Comparison(tuple(entries), contradicting)


def every_solver() -> tuple[solvers.Solver, ...]:
    """All solvers of the package, and SCS and QOCO through CVXPY if they are installed.

    Solvers of the package that end with a Newton step are also included without this step.

    >>> from convexrough.comparison import every_solver
    >>> [solver.name for solver in every_solver()][:3]
    ['newton', 'conic + Newton step', 'conic']
    """
    return (
        solvers.Newton(),
        solvers.Conic(),
        solvers.Conic(newton_step=False),
        solvers.ConicCVXPY(),
        solvers.ConicCVXPY(newton_step=False),
        *(solvers.ConicCVXPY(solver=each) for each in THROUGH_CVXPY if find_spec(each.lower())),
        solvers.BristleQP(),
        solvers.BristleQP(newton_step=False),
    )


def solver_named(name: str) -> solvers.Solver:
    """The solver with this name.

    name : the name of a solver of the package, as in scene files, such as "newton"; or the import
        path of a class, such as "mine.Solver", which is called without arguments

    Raises InputError if there is no such solver.

    >>> from convexrough.comparison import solver_named
    >>> solver_named("conic") == cr.solvers.Conic()
    True
    """
    module, _, attribute = name.rpartition(".")
    if not module:
        return solvers.named(name)
    expected = "package.Class, the import path of a solver that needs no arguments"
    try:
        made = getattr(import_module(module), attribute)()
    except (Exception, SystemExit) as error:  # a user's module may raise anything
        found = f"{name} ({type(error).__name__}: {error})"
        raise InputError("solver", found=found, expected=expected) from error
    return solvers.named(made)


_REFERENCE = solvers.Newton()


def _enter(solver: solvers.Solver, pressed: Callable[..., Contact]) -> Entry:
    """The entry of a solver, not yet compared with the reference."""
    memory = MemoryRise()
    try:
        contact = pressed(solver=solver)
    except SolverError as error:
        return Entry(solver.name, "failed", str(error))
    except InputError as error:
        if solver == _REFERENCE:
            raise
        return Entry(solver.name, "refused", str(error))
    except (Exception, SystemExit) as error:  # a user's solver may raise anything
        if type(solver).__module__.startswith("convexrough."):
            raise
        file = getattr(sys.modules[type(solver).__module__], "__file__", None)
        places = [each for each in extract_tb(error.__traceback__) if each.filename == file]
        place = f" ({Path(places[-1].filename).name}:{places[-1].lineno})" if places else ""
        return Entry(solver.name, "failed", f"{type(error).__name__}: {error}{place}")
    return Entry(contact.solver, "answered", contact=contact, memory=memory.risen())


def _against(entry: Entry, reference: Entry) -> Entry:
    """The entry, compared with the reference if both have a solution."""
    found, known = entry.contact, reference.contact
    if found is None or known is None:
        return entry
    apart, scale = float(np.abs(found.loads - known.loads).max()), float(known.loads.max())
    low, high = np.sort([np.abs(found.loads), known.loads], axis=0) / (scale or 1.0)
    return replace(
        entry,
        disagreement=apart / scale if apart > 0 else 0.0,
        different_statuses=int(np.sum(found.status != known.status)),
        different_contacts=int(((low < CARRIES / 10) & (high > CARRIES)).sum()),
    )


class Answer(NamedTuple):
    """Loads with their certificate; `name` says in messages where the loads come from."""

    name: str
    loads: Array
    certificate: Certificate


def contradictions(first: Answer, second: Answer) -> list[str]:
    """A sentence for each kind of contradiction between two results.

    Two results contradict each other if loads, gaps or approaches differ by more than the sum of
    their error bounds, or if an asperity is proved to touch by one and to be open by the other. A
    result of scope "none" contradicts no other.
    """
    one, other = first.certificate, second.certificate
    if "none" in (one.scope, other.scope):
        return []
    lines = []

    def note(kind: str, values: tuple[Array, Array], bounds: tuple[Array, Array]) -> None:
        apart = np.abs(values[0] - values[1])
        if len(where := np.flatnonzero(apart > bounds[0] + bounds[1])):
            each = (
                f"{i}: {values[0][i]:.6g} +- {bounds[0][i]:.2g} and {values[1][i]:.6g} +- "
                f"{bounds[1][i]:.2g}"
                for i in where[np.argsort(-apart[where])]
            )
            lines.append(f"{kind} of asperities {joined(each)}")

    note("loads", (first.loads, second.loads), (one.load_errors, other.load_errors))
    note("gaps", (one.gaps, other.gaps), (one.gap_errors, other.gap_errors))
    if abs(one.approach - other.approach) > one.approach_error + other.approach_error:
        lines.append(
            f"approach {one.approach:.17g} +- {one.approach_error:.2g} and {other.approach:.17g} "
            f"+- {other.approach_error:.2g}"
        )
    proved = (one.status != "undecided") & (other.status != "undecided")
    if len(where := np.flatnonzero(proved & (one.status != other.status))):
        each = (f"{i}: {one.status[i]} and {other.status[i]}" for i in where)
        lines.append(f"statuses of asperities {joined(each)}")
    return [f"{first.name} and {second.name}: {line}" for line in lines]


def joined(items: Iterator[str]) -> str:
    """The first `MOST_NAMED` texts in one, with the number of the others."""
    named = list(items)
    more = f"; and {len(named) - MOST_NAMED} more" if len(named) > MOST_NAMED else ""
    return "; ".join(named[:MOST_NAMED]) + more
