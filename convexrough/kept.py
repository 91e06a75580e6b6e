"""A cache on an object: derived objects are stored on it and freed with it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self, TypeVar

Made = TypeVar("Made")


class Keeper:
    """Base class that caches objects derived from it; each is made once and freed with it."""

    def keep(self, make: Callable[[Self], Made]) -> Made:
        """make(self), cached. The result must not refer to self, or memory is freed late."""
        kept: dict[Any, Any] = self.__dict__.setdefault("_kept", {})
        if make not in kept:
            kept[make] = make(self)
        made: Made = kept[make]
        return made
