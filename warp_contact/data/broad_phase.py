"""What may touch, for as many steps as it holds."""

from dataclasses import dataclass

import warp as wp


@dataclass
class Pairs:
    """Vertices (or edges) and the bodies whose tets (or triangles) they may come to meet.

    Attributes:
        n: number of pairs, shape (1,)
        pair: owner and body, in this order, shape (capacity,)
        start: first pair of each owner, shape (n_owner + 1,)
        items: first and end of each pair in ``item``, shape (capacity,)
        item: tets or triangles, ascending for each owner, shape (capacity of items,)
        item_start: first item of each owner, shape (n_owner + 1,)
        wake: way of owner and body up to which they do not meet [m], shape (capacity,)
    """

    n: wp.array
    pair: wp.array
    start: wp.array
    items: wp.array
    item: wp.array
    item_start: wp.array
    wake: wp.array


@dataclass
class Candidates:
    """What may touch as long as no vertex is further than the skin from where it was then.

    Attributes:
        x: positions of the candidates [m], shape (n_vert,)
        free: how far from them a prediction may be [m], shape (n_body,)
        skin: how far from them they hold [m], shape (n_body,)
        motion: largest motion of each body since the last look [m], shape (n_body,)
        pace: what motion to expect in the next looks [m], shape (n_body,)
        fastest: largest of the motions when they were found [m], shape (1,)
        total: their sum, in counts of kernels/broad_phase/margins.py, shape (1,)
        stale: whether they have to be found again, shape (1,)
        edge: shortest mean edge of a body [m]
        verts: vertices and bodies with tets; a plane is a body with one tet
        edges: surface edges and bodies with triangles
        some: whether there are any, shape (1,)
        last: positions of the last look [m], shape (n_vert,)
        way: sum of the motions since the candidates were found [m], shape (n_body + n_plane,)
        n_found: length of the list that is being filled, shape (1,)
        vert_tet, edge_tri: what was found in any order, shapes (capacity.tets,), (capacity.tris,)
        near_tri: triangles in the slabs of near bodies, shape (capacity.near,)
    """

    x: wp.array
    free: wp.array
    skin: wp.array
    motion: wp.array
    pace: wp.array
    fastest: wp.array
    total: wp.array
    stale: wp.array
    edge: float
    verts: Pairs
    edges: Pairs
    some: wp.array
    last: wp.array
    way: wp.array
    n_found: wp.array
    vert_tet: wp.array
    edge_tri: wp.array
    near_tri: wp.array
