"""How far long work has come: said to the logger `convexrough`, which the command line shows."""

import logging
from collections.abc import Callable

LOGGER = logging.getLogger("convexrough")

#: Told in a line how far long work has come.
Announce = Callable[[str], object]


def tell(news: str) -> None:
    """Say in a line how far long work has come."""
    LOGGER.info(news)
