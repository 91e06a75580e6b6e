"""Base class of objects that store results computed from them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self, TypeVar

Made = TypeVar("Made")


class Cached:
    """Base class of objects that store results computed from them for as long as they exist."""

    def cached(self, make: Callable[[Self], Made]) -> Made:
        """make(self), computed once. Its memory is freed late if the result refers to self."""
        cache: dict[Any, Any] = self.__dict__.setdefault("_cache", {})
        if make not in cache:
            cache[make] = make(self)
        made: Made = cache[make]
        return made
