"""The contacts of a step, and how much there is room for."""

from dataclasses import dataclass

import warp as wp


@dataclass
class Contacts:
    """What stage 1 and 2 find, rebuilt in every step. Vertex c's side moves along the normal.

    A contact joins a vertex, or a point of an edge, to a point of a triangle, or of its edge, by
    five vertices with signed weights: gap = (sum coef x) . normal - offset. The first
    ``n_hit`` contacts are those of vertices. All capacities are fixed; what does not
    fit is counted in ``needed`` and never written.

    Attributes:
        n: number of contacts, shape (1,)
        needed: capacities that would have been enough (of pairs of bodies: one more than there is),
            0 where they were, in the order of ``Capacity``; shape (7,)
        vert: vertices, shape (capacity, 5)
        coef: signed weights, shape (capacity, 5)
        normal: unit direction, shape (capacity,)
        depth: at detection [m], 0 of edges that go on, shape (capacity,)
        offset: of a plane, else 0 [m], shape (capacity,)
        pair: the two bodies, n_body + p for plane p, shape (capacity,)
        start: first entry of each vertex in ``entry``, shape (n_vert + 1,)
        entry: contacts at each vertex as 5 contact + k, shape (5 capacity,)
        n_touched: vertices with entries, shape (1,)
        touched: which ones, in any order, shape (n_vert,)
        weight: sum of coef^2 N / m [1/kg], shape (capacity,)
        coupled: the same with what the couple of friction adds [1/kg], shape (capacity,)
        closing: approach that is allowed [m/s], negative for less than the resting gap at the start
            of the step, shape (capacity,)
        open: gap at the start of the step [m], shape (capacity,)
        turn: how couples are handed to the vertices [1/m], shape (capacity, 5)
        lam: normal impulse of the step [N s], shape (capacity,)
        slip: tangential impulse of the step [N s], shape (capacity,)
        ahead: extrapolated tangential and normal impulse [N s], shape (capacity,)
        mu: coefficient of friction, 0 across a wide gap, shape (capacity,)
        ramp: how a facet leans away from the normal, 0 where it does not, shape (capacity,)
        busy: 2 where the last sweep changed the impulses, 1 a little, 0 where it left them alone,
            shape (capacity,)
        part: what the last sweep adds at each vertex [N s], shape (5 capacity,)
        left: overlap after the impulses [m], shape (capacity,)
        slack: part of it that later steps resolve [m], shape (capacity,)
        push: of the closure [kg m], shape (capacity,)
    """

    n: wp.array
    needed: wp.array
    vert: wp.array
    coef: wp.array
    normal: wp.array
    depth: wp.array
    offset: wp.array
    pair: wp.array
    start: wp.array
    entry: wp.array
    n_touched: wp.array
    touched: wp.array
    weight: wp.array
    coupled: wp.array
    closing: wp.array
    open: wp.array
    turn: wp.array
    lam: wp.array
    slip: wp.array
    ahead: wp.array
    mu: wp.array
    ramp: wp.array
    busy: wp.array
    part: wp.array
    left: wp.array
    slack: wp.array
    push: wp.array


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
