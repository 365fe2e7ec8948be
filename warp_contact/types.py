"""The data of a simulation: ``Model`` is frozen, ``State`` evolves, the rest is scratch.

All arrays are flat over the whole scene. A body is a range of vertices, tets and triangles.
"""

from dataclasses import dataclass
from types import ModuleType

import warp as wp


@dataclass(frozen=True)
class Elements:
    """The tets that share one material model.

    Attributes:
        kernels: the model's kernel file
        tet: tet ids, shape (n,)
        param: parameters of each tet in the order of the model's class, shape (n,) of its ``ROW``
        damped: whether any of them has a damping time above zero
    """

    kernels: ModuleType
    tet: wp.array
    param: wp.array
    damped: bool


@dataclass(frozen=True)
class Model:
    """What does not change during a run.

    Attributes:
        labels: name of each body
        materials: material of each body, as given by the user
        elements: the tets, one entry for each material model in use
        gravity: acceleration [m/s^2]
        friction: Coulomb coefficient [-]
        n_body: number of bodies
        n_vert: number of vertices
        n_tet: number of tets
        n_tri: number of surface triangles
        n_edge: number of surface edges
        n_surf: number of surface vertices
        n_plane: number of half-spaces
        cell: edge of the hash cells, the mean edge length of the tets [m]
        body_vert: first vertex of each body, shape (n_body + 1,)
        body_tet: first tet of each body, shape (n_body + 1,)
        body_tri: first surface triangle of each body, shape (n_body + 1,)
        body_world: bodies of different worlds never touch, shape (n_body,)
        body_edge: mean edge length of each body [m], shape (n_body,)
        body_thickness: twice the volume over the surface area of each body [m], shape (n_body,)
        vert_body: body of each vertex, shape (n_vert,)
        mass: vertex masses [kg], shape (n_vert,)
        inv_mass: their inverses, 0 for a fixed vertex [1/kg], shape (n_vert,)
        surf: ids of the surface vertices, ascending, shape (n_surf,)
        on_surface: 1 for a surface vertex, shape (n_vert,)
        tets: positively oriented, shape (n_tet,)
        tet_body: body of each tet, and of each plane behind them, shape (n_tet + n_plane,)
        pose: inverse of the rest edge matrix of each tet [1/m], shape (n_tet,)
        volume: rest volume of each tet [m^3], shape (n_tet,)
        tris: surface triangles, outward, shape (n_tri,)
        tri_body: body of each triangle, shape (n_tri,)
        edges: surface edges and their two triangles (p, q, t1, t2), shape (n_edge,)
        vt_start: first entry of each vertex in ``vt_corner``, shape (n_vert + 1,)
        vt_corner: tet corners at each vertex, as 4 tet + corner, shape (4 n_tet,)
        vs_start: first entry of each vertex in ``vs_tri``, shape (n_vert + 1,)
        vs_tri: surface triangles at each vertex, shape (3 n_tri,)
        vn_start: first entry of each vertex in ``vn_vert``, shape (n_vert + 1,)
        vn_vert: neighbours of each vertex along tet edges, ascending
        plane_n: outward unit normals, shape (n_plane,)
        plane_h: offsets along the normals [m], shape (n_plane,)
    """

    labels: tuple[str, ...]
    materials: tuple
    elements: tuple[Elements, ...]
    gravity: tuple[float, float, float]
    friction: float
    n_body: int
    n_vert: int
    n_tet: int
    n_tri: int
    n_edge: int
    n_surf: int
    n_plane: int
    cell: float
    body_vert: wp.array
    body_tet: wp.array
    body_tri: wp.array
    body_world: wp.array
    body_edge: wp.array
    body_thickness: wp.array
    vert_body: wp.array
    mass: wp.array
    inv_mass: wp.array
    surf: wp.array
    on_surface: wp.array
    tets: wp.array
    tet_body: wp.array
    pose: wp.array
    volume: wp.array
    tris: wp.array
    tri_body: wp.array
    edges: wp.array
    vt_start: wp.array
    vt_corner: wp.array
    vs_start: wp.array
    vs_tri: wp.array
    vn_start: wp.array
    vn_vert: wp.array
    plane_n: wp.array
    plane_h: wp.array


@dataclass
class State:
    """What a step advances.

    Attributes:
        x: positions [m], shape (n_vert,)
        v: velocities [m/s]; those of fixed vertices are prescribed, shape (n_vert,)
    """

    x: wp.array
    v: wp.array


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
class Awake:
    """What moves: all, unless bodies at rest may sleep.

    Attributes:
        bodies: 1, asleep 0, shape (n_body,)
        tets: the same of the tets, shape (n_tet,)
        inv_mass: 1 / m, 0 for a fixed vertex and asleep [1/kg], shape (n_vert,)
    """

    bodies: wp.array
    tets: wp.array
    inv_mass: wp.array


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
        total: their sum, in counts of kernels/candidates.py, shape (1,)
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
