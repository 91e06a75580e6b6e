"""The command line: one file per command, and how all of them take options and speak."""

from convexrough.cli.program import main as main
