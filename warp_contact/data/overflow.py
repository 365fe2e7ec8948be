"""The capacities of a step's lists, and what did not fit."""

from dataclasses import dataclass

import warp as wp


@dataclass(frozen=True)
class Capacity:
    """The capacities of a step's lists.

    Attributes:
        contacts: contacts, and penetrations
        pairs: pairs of bodies with a contact force
        verts: pairs of a vertex and a body that it may enter
        tets: the tets of these pairs
        edges: pairs of an edge and a body that it may cross
        tris: the triangles of these pairs
        near: triangles of near bodies that reach into the slab of a body
    """

    contacts: int = 192
    pairs: int = 64
    verts: int = 256
    tets: int = 1024
    edges: int = 256
    tris: int = 1024
    near: int = 1024


@dataclass
class Overflow:
    """Capacities that would have been enough, 0 where the present ones are: each of shape (1,).

    What does not fit is counted here and never written. For pairs of bodies it is one more than
    the capacity.

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
