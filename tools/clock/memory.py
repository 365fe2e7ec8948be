"""The Warp arrays behind a simulation, and their bytes."""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass

import warp as wp


def arrays(holder) -> Iterator[wp.array]:
    """All arrays in a dataclass, a Warp struct or a tuple of these."""
    if isinstance(holder, wp.array):
        yield holder
    elif is_dataclass(holder):
        yield from arrays(tuple(getattr(holder, field.name) for field in fields(holder)))
    elif isinstance(holder, tuple):
        for item in holder:
            yield from arrays(item)
    elif hasattr(holder, "_cls"):  # an instance of a wp.struct
        yield from arrays(tuple(getattr(holder, name) for name in holder._cls.vars))


def held(*holders) -> int:
    """Bytes of all their arrays; what several of them share counts once."""
    total, last = 0, 0
    for a in sorted(arrays(holders), key=lambda a: a.ptr or 0):
        end = (a.ptr or 0) + a.size * wp.types.type_size_in_bytes(a.dtype)
        total += max(0, end - max(a.ptr or 0, last))
        last = max(last, end)
    return total
