"""`check`: the checker of proof files."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli.output import PATH


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
