"""Scratch memory of a step, allocated once and kept until a capacity has to grow."""

from dataclasses import dataclass

import warp as wp

from warp_contact.kernels import bounds
from warp_contact.types import Capacity, Contacts, Model, State


@dataclass
class Work:
    """Arrays that a step fills and forgets.

    Attributes:
        capacity: what there is room for
        dt: the step [s], shape (1,)
        ones: a mask that lets every tet pass, shape (n_tet,)
        mask: tets that touch the deformation region, shape (n_tet,)
        f_tet: forces on the corners of each tet [N], shape (n_tet, 4)
        x: predicted positions, then those before stage 4 [m], shape (n_vert,)
        v: scratch of the damping [m/s], shape (n_vert,)
        lower, upper: boxes of the bodies [m], shape (n_body,)
        tri_lower, tri_upper: boxes of the triangles [m], shape (n_tri,)
        bodies: Bvh over the bodies, grouped by world
        surface: Bvh over the triangles, grouped by body
        n_near: number of near bodies, shape (n_body,)
        near: their ids, shape (n_body, capacity.near)
        key: hash of each vertex' cell, -1 for none, shape (n_vert,)
        cell_start: first vertex of each cell, shape (n_cell + 1,)
        cell_vert: vertices by cell, shape (n_vert,)
        inside: bodies that each vertex is inside of, shape (n_vert * capacity.slots,)
        hit_start: first hit of each vertex, shape (n_vert + 1,)
        hit_vert, hit_body, hit_layer, hit_depth, hit_dir: the hits, shape (capacity.contacts,)
        edge_start: first crossing of each surface edge, shape (n_edge + 1,)
        edge_close: edges that were close to another body's triangle, shape (n_edge,)
        edge_body: bodies that each edge crosses, shape (n_edge, capacity.edge_slots)
        layer: layer of the propagation, shape (1,)
        pending: whether it goes on, shape (1,)
        contacts: the contact records
        none: zero, shape (1,)
        n_hit, n_crossing: views of the last entries of ``hit_start`` and ``edge_start``
        done: sweeps over the contacts so far, shape (1,)
        again: whether another is needed, shape (1,)
        found: whether stage 4 has anything to close and to search, shape (2,)
        deep_found: whether it had anything to search since the frame began, shape (1,)
        s: displacement vectors [m], shape (n_vert,)
        area: areas of comparison [m^2], shape (n_vert,)
        before, now: tractions before stage 4 and at a trial [Pa], shape (n_vert,)
        stiffness: traction gained over the whole of s [Pa], shape (n_vert,)
        fraction: part of s, shape (n_vert,)
        upper_mean, lower_mean: both sides of each contact, shape (capacity.contacts,)
        impulse: received by each vertex since the frame began [N s], shape (n_vert,)
        pair_key: bodies of a pair with a contact force, shape (capacity.pairs,)
        pair_total: its impulse since the frame began, in units, shape (capacity.pairs, 3)
    """

    capacity: Capacity
    dt: wp.array
    ones: wp.array
    mask: wp.array
    f_tet: wp.array
    x: wp.array
    v: wp.array
    lower: wp.array
    upper: wp.array
    tri_lower: wp.array
    tri_upper: wp.array
    bodies: wp.Bvh
    surface: wp.Bvh
    n_near: wp.array
    near: wp.array
    key: wp.array
    cell_start: wp.array
    cell_vert: wp.array
    inside: wp.array
    hit_start: wp.array
    hit_vert: wp.array
    hit_body: wp.array
    hit_layer: wp.array
    hit_depth: wp.array
    hit_dir: wp.array
    edge_start: wp.array
    edge_close: wp.array
    edge_body: wp.array
    layer: wp.array
    pending: wp.array
    contacts: Contacts
    none: wp.array
    n_hit: wp.array
    n_crossing: wp.array
    done: wp.array
    again: wp.array
    found: wp.array
    deep_found: wp.array
    s: wp.array
    area: wp.array
    before: wp.array
    now: wp.array
    stiffness: wp.array
    fraction: wp.array
    upper_mean: wp.array
    lower_mean: wp.array
    impulse: wp.array
    pair_key: wp.array
    pair_total: wp.array


def allocate_work(model: Model, state: State, capacity: Capacity) -> Work:
    """Room for a step on the current device; the Bvhs are built around ``state.x``."""
    n, m = model.n_vert, capacity.contacts
    lower, upper = _vectors(model.n_body), _vectors(model.n_body)
    tri_lower, tri_upper = _vectors(model.n_tri), _vectors(model.n_tri)
    n_near = wp.full(model.n_body, 1, dtype=int)
    hit_start, edge_start = _ints(n + 1), _ints(model.n_edge + 1)
    launch_body_boxes(model, state.x, state.x, lower, upper)
    launch_triangle_boxes(model, state.x, state.x, n_near, tri_lower, tri_upper)
    return Work(
        capacity=capacity,
        dt=wp.zeros(1, dtype=float),
        ones=wp.full(model.n_tet, 1, dtype=int),
        mask=_ints(model.n_tet),
        f_tet=wp.zeros((model.n_tet, 4), dtype=wp.vec3),
        x=_vectors(n),
        v=_vectors(n),
        lower=lower,
        upper=upper,
        tri_lower=tri_lower,
        tri_upper=tri_upper,
        bodies=wp.Bvh(lower, upper, groups=model.body_world),
        surface=wp.Bvh(tri_lower, tri_upper, groups=model.tri_body),
        n_near=n_near,
        near=wp.zeros((model.n_body, capacity.near), dtype=int),
        key=_ints(n),
        cell_start=_ints(2 * n + 2),
        cell_vert=_ints(n),
        inside=_ints(n * capacity.slots),
        hit_start=hit_start,
        hit_vert=_ints(m),
        hit_body=_ints(m),
        hit_layer=_ints(m),
        hit_depth=_floats(m),
        hit_dir=_vectors(m),
        edge_start=edge_start,
        edge_close=_ints(model.n_edge),
        edge_body=wp.zeros((model.n_edge, capacity.edge_slots), dtype=int),
        layer=_ints(1),
        pending=_ints(1),
        contacts=_allocate_contacts(n, m),
        none=_ints(1),
        n_hit=hit_start[n:],
        n_crossing=edge_start[model.n_edge :],
        done=_ints(1),
        again=_ints(1),
        found=_ints(2),
        deep_found=_ints(1),
        s=_vectors(n),
        area=_floats(n),
        before=_floats(n),
        now=_floats(n),
        stiffness=_floats(n),
        fraction=_floats(n),
        upper_mean=_vectors(m),
        lower_mean=_vectors(m),
        impulse=_vectors(n),
        pair_key=wp.full(capacity.pairs, -1, dtype=wp.int64),
        pair_total=wp.zeros((capacity.pairs, 3), dtype=wp.int64),
    )


def launch_body_boxes(
    model: Model, x0: wp.array, x1: wp.array, lower: wp.array, upper: wp.array
) -> None:
    """Set the boxes of the bodies around both positions."""
    wp.launch(bounds.clear_boxes, dim=model.n_body, inputs=[], outputs=[lower, upper])
    wp.launch(
        bounds.body_boxes,
        dim=-(-model.n_surf // int(bounds.CHUNK)),
        inputs=[model.surf, model.vert_body, x0, x1],
        outputs=[lower, upper],
    )


def launch_triangle_boxes(
    model: Model,
    x0: wp.array,
    x1: wp.array,
    n_near: wp.array,
    lower: wp.array,
    upper: wp.array,
) -> None:
    """Set the boxes of the triangles of bodies that are near another, around both positions."""
    wp.launch(
        bounds.triangle_boxes,
        dim=model.n_tri,
        inputs=[model.tris, model.tri_body, n_near, model.body_edge, x0, x1],
        outputs=[lower, upper],
    )


def _allocate_contacts(n: int, m: int) -> Contacts:
    return Contacts(
        n=_ints(1),
        needed=_ints(5),
        vert=wp.zeros((m, 5), dtype=int),
        coef=wp.zeros((m, 5), dtype=float),
        normal=_vectors(m),
        depth=_floats(m),
        offset=_floats(m),
        pair=wp.zeros(m, dtype=wp.vec2i),
        start=_ints(n + 1),
        entry=_ints(5 * m),
        weight=_floats(m),
        closing=_floats(m),
        open=_floats(m),
        turn=wp.zeros((m, 5), dtype=wp.vec3),
        lam=_floats(m),
        slip=_vectors(m),
        ahead=wp.zeros(m, dtype=wp.vec4),
        change=_vectors(m),
        left=_floats(m),
        slack=_floats(m),
        push=_floats(m),
    )


def _ints(n: int) -> wp.array:
    return wp.zeros(n, dtype=int)


def _floats(n: int) -> wp.array:
    return wp.zeros(n, dtype=float)


def _vectors(n: int) -> wp.array:
    return wp.zeros(n, dtype=wp.vec3)
