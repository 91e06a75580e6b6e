"""The command line: the program, its commands, and the options and output that they share."""

from convexrough.cli.program import main as main
