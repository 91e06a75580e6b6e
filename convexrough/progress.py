"""How long work says how far it has come."""

from collections.abc import Callable

#: Told in a line how far long work has come.
Announce = Callable[[str], object]
