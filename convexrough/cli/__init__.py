"""The command line: a module for each command, and modules for shared options and output."""

from convexrough.cli.program import main as main
