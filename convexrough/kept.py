"""What later stages make of an object, kept as long as the object is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self, TypeVar

Made = TypeVar("Made")


class Keeper:
    """Keeps what is made from it: each thing is made once, and freed with its maker."""

    def keep(self, make: Callable[[Self], Made]) -> Made:
        """make(self), which must not hold self: then nothing waits for a garbage collector."""
        kept: dict[Any, Any] = self.__dict__.setdefault("_kept", {})
        if make not in kept:
            kept[make] = make(self)
        made: Made = kept[make]
        return made

    def kept(self, make: Callable[[Self], Made]) -> Made | None:
        """What `keep` made before; None if it was not asked to."""
        found: Made | None = self.__dict__.get("_kept", {}).get(make)
        return found
