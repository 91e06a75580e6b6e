"""A cache on an object: derived objects are stored on it and freed with it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self, TypeVar

Made = TypeVar("Made")


class Cached:
    """Base class that caches objects derived from it; each is made once and freed with it."""

    def cached(self, make: Callable[[Self], Made]) -> Made:
        """make(self), cached. The result must not refer to self, or memory is freed late."""
        cache: dict[Any, Any] = self.__dict__.setdefault("_cache", {})
        if make not in cache:
            cache[make] = make(self)
        made: Made = cache[make]
        return made
