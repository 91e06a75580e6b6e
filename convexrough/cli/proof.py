"""`check`, and how `run` and `verify` prove what it checks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from convexrough.cli.options import PATH
from convexrough.cli.speech import progress, say_aside
from convexrough.errors import ProofError

if TYPE_CHECKING:
    from convexrough.proof import Proof


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


def proved(work: Callable[[], Proof]) -> Proof | None:
    """The proof, or None after a warning with the reason."""
    try:
        with progress("proving"):
            return work()
    except ProofError as error:
        say_aside("warning", f"proof.json is not written: {error}")
        return None
