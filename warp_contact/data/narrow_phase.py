"""Intermediate results of the narrow phase."""

from dataclasses import dataclass

import warp as wp

from warp_contact.data.overflow import Capacity
from warp_contact.kernels.narrow_phase.edge_contact import EdgeContact
from warp_contact.kernels.narrow_phase.vertices import Penetration


@dataclass
class NarrowPhase:
    """Penetrations, and the contacts of edges by their places.

    Attributes:
        inside_at: penetrations before each pair of a vertex and a body, shape (pairs + 1,)
        n_inside: their number: the last entry, shape (1,)
        penetration: vertices inside bodies, shape (contacts,)
        layer: layer of the propagation of depths, shape (1,)
        pending: whether another layer is needed, shape (1,)
        crossing_at: contacts before each pair of an edge and a body, shape (pairs + 1,)
        n_crossing: their number: the last entry, shape (1,)
        found: contacts of edges in any order, shape (contacts,)
        n_place: places taken in ``found``, some of them no longer in use, shape (1,)
        place: place of the first contact of each pair, -1 for none, shape (pairs,)
        source: place of each contact of an edge, shape (contacts,)
        new: the two below, shape (1 + n_world,)
        n_new: contacts of edges that the last detection pass has added, shape (1,)
        has_new: 1 for each world that has some of them, shape (n_world,)
        none: zero, shape (1,)
    """

    inside_at: wp.array[int]
    n_inside: wp.array[int]
    penetration: wp.array[Penetration]
    layer: wp.array[int]
    pending: wp.array[int]
    crossing_at: wp.array[int]
    n_crossing: wp.array[int]
    found: wp.array[EdgeContact]
    n_place: wp.array[int]
    place: wp.array[int]
    source: wp.array[int]
    new: wp.array[int]
    n_new: wp.array[int]
    has_new: wp.array[int]
    none: wp.array[int]


def allocate(capacity: Capacity, n_world: int) -> NarrowPhase:
    """Allocate without any contact."""
    inside_at = wp.zeros(capacity.verts + 1, dtype=int)
    crossing_at = wp.zeros(capacity.edges + 1, dtype=int)
    new = wp.zeros(1 + n_world, dtype=int)
    return NarrowPhase(
        inside_at=inside_at,
        n_inside=inside_at[capacity.verts :],
        penetration=wp.zeros(capacity.contacts, dtype=Penetration),
        layer=wp.zeros(1, dtype=int),
        pending=wp.zeros(1, dtype=int),
        crossing_at=crossing_at,
        n_crossing=crossing_at[capacity.edges :],
        found=wp.zeros(capacity.contacts, dtype=EdgeContact),
        n_place=wp.zeros(1, dtype=int),
        place=wp.zeros(capacity.edges, dtype=int),
        source=wp.zeros(capacity.contacts, dtype=int),
        new=new,
        n_new=new[:1],
        has_new=new[1:],
        none=wp.zeros(1, dtype=int),
    )
