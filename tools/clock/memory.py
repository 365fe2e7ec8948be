"""The Warp arrays behind a simulation: their bytes, and a copy to come back to."""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass

import warp as wp


def arrays(holder) -> Iterator[wp.array]:
    """All arrays in a dataclass, a Warp struct or a tuple of these."""
    if isinstance(holder, wp.array):
        yield holder
    elif is_dataclass(holder):
        for field in fields(holder):
            yield from arrays(getattr(holder, field.name))
    elif isinstance(holder, tuple):
        for item in holder:
            yield from arrays(item)
    elif hasattr(holder, "_cls"):  # an instance of a wp.struct
        for name in holder._cls.vars:
            yield from arrays(getattr(holder, name))


def held(*holders) -> int:
    """Bytes of all their arrays; what several of them share counts once."""
    total, last = 0, 0
    for a in sorted(arrays(holders), key=lambda a: a.ptr or 0):
        end = (a.ptr or 0) + a.size * wp.types.type_size_in_bytes(a.dtype)
        total += max(0, end - max(a.ptr or 0, last))
        last = max(last, end)
    return total


class Snapshot:
    """The contents of all arrays of some holders at one moment."""

    def __init__(self, *holders):
        """Copy them."""
        self._copies = [(a, wp.clone(a)) for a in arrays(holders) if a.size]

    def restore(self) -> None:
        """Put the contents back."""
        for a, copy in self._copies:
            wp.copy(a, copy)
