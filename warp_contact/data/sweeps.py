"""The state of repeated sweeps over the contacts, for the impulses and for the closure."""

from dataclasses import dataclass

import warp as wp


@dataclass
class Sweeps:
    """Counters of sweeps, and which contacts a sweep leaves alone.

    Attributes:
        number: sweeps so far, shape (1,)
        again: whether another is needed, shape (1,)
        busy: 2 where the last sweep changed the impulses, 1 negligibly, 0 where it left them alone,
            shape (contacts,)
        changed: the last sweep, if it changed the velocity of a vertex, else 0, shape (n_vert,)
        served: the last sweep that added anything to a vertex, shape (n_vert,)
    """

    number: wp.array[int]
    again: wp.array[int]
    busy: wp.array[int]
    changed: wp.array[int]
    served: wp.array[int]


def allocate(n_vert: int, n_contact: int) -> Sweeps:
    """Allocate before any sweep."""
    return Sweeps(
        number=wp.zeros(1, dtype=int),
        again=wp.zeros(1, dtype=int),
        busy=wp.zeros(n_contact, dtype=int),
        changed=wp.zeros(n_vert, dtype=int),
        served=wp.zeros(n_vert, dtype=int),
    )
