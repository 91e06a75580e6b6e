"""The logger `convexrough`: long work reports its progress there, and the command line shows it."""

import logging

LOGGER = logging.getLogger("convexrough")
