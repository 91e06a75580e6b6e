"""Objects that store what was computed from them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self, TypeVar

Made = TypeVar("Made")


class Cached:
    """Base class of objects that store what is computed from them for as long as they exist."""

    def cached(self, make: Callable[[Self], Made]) -> Made:
        """make(self), computed once. The result must not refer to self, or memory is freed late."""
        cache: dict[Any, Any] = self.__dict__.setdefault("_cache", {})
        if make not in cache:
            cache[make] = make(self)
        made: Made = cache[make]
        return made
