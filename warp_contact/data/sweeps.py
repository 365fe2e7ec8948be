"""The state of repeated sweeps over the contacts, for the impulses and for the closure."""

from dataclasses import dataclass

import warp as wp


@dataclass
class Sweeps:
    """Which worlds go on sweeping, and which contacts a sweep leaves alone.

    Attributes:
        running: worlds that need another, shape (1,)
        busy: 2 where the last sweep changed the impulses, 1 negligibly, 0 where it left them alone,
            shape (contacts,)
        changed: the last sweep, if it changed the velocity of a vertex, else 0, shape (n_vert,)
        served: the last sweep that added anything to a vertex, shape (n_vert,)
        no_dt: an empty array, for kept impulses that are not divided by a step
    """

    running: wp.array[int]
    busy: wp.array[int]
    changed: wp.array[int]
    served: wp.array[int]
    no_dt: wp.array[float]


def allocate(n_vert: int, n_contact: int) -> Sweeps:
    """Allocate before any sweep."""
    return Sweeps(
        running=wp.zeros(1, dtype=int),
        busy=wp.zeros(n_contact, dtype=int),
        changed=wp.zeros(n_vert, dtype=int),
        served=wp.zeros(n_vert, dtype=int),
        no_dt=wp.zeros(0, dtype=float),
    )
