"""How much room a step has in its lists, and what did not fit."""

from dataclasses import dataclass

import warp as wp


@dataclass(frozen=True)
class Capacity:
    """How much a step has room for.

    Attributes:
        contacts: contacts, and vertices inside other bodies
        pairs: pairs of bodies with a contact force
        verts: pairs of a vertex and a body that may come to hold it
        tets: the tets in question
        edges: pairs of an edge and a body that it may come to cross
        tris: the triangles in question
        near: triangles of near bodies that reach into the slab of a body
    """

    contacts: int = 256
    pairs: int = 64
    verts: int = 256
    tets: int = 1024
    edges: int = 256
    tris: int = 1024
    near: int = 1024


@dataclass
class Overflow:
    """Capacities that would have been enough, 0 where they were: each of shape (1,).

    What does not fit is counted here and never written. Of pairs of bodies it is one more than
    there is room for.

    Attributes:
        all: the same in one array, in the order of ``Capacity``, shape (7,)
    """

    all: wp.array[int]
    contacts: wp.array[int]
    pairs: wp.array[int]
    verts: wp.array[int]
    tets: wp.array[int]
    edges: wp.array[int]
    tris: wp.array[int]
    near: wp.array[int]


def allocate() -> Overflow:
    """Nothing has overflowed."""
    needed = wp.zeros(7, dtype=int)
    return Overflow(needed, *(needed[k : k + 1] for k in range(7)))
