"""Scratch memory of a step, allocated once and kept until a capacity has to grow."""

from dataclasses import dataclass

import warp as wp

from warp_contact.data.broad_phase import Candidates, Pairs
from warp_contact.data.contacts import Capacity, Contacts
from warp_contact.data.model import Model
from warp_contact.data.state import Awake, State
from warp_contact.data.warm_start import Warm, allocate
from warp_contact.kernels.broad_phase import bounds
from warp_contact.kernels.broad_phase.near import MANY, Near
from warp_contact.kernels.narrow_phase.edge_contact import EdgeContact

LEAF = 8  # triangles in a leaf: to ask for the few near a vertex takes a quarter less than with 1


@dataclass
class Work:
    """Arrays that a step fills and forgets; but for ``warm``, and the forces of who sleeps.

    Attributes:
        capacity: what there is room for
        dt: the step [s], shape (1,)
        share: of the stages of the damping [-], shape (1,)
        steps: how many the frame still has, shape (1,)
        awake: what moves
        mask: tets that touch the deformation region, shape (n_tet,)
        f_tet: forces on the corners of each tet [N], shape (4 n_tet,)
        x: predicted positions, then those before stage 4 [m], shape (n_vert,)
        v: scratch of the damping [m/s], shape (n_vert,)
        lower, upper: boxes of the bodies [m], shape (n_body,)
        tri_lower, tri_upper: boxes of the triangles [m], shape (n_tri,)
        bodies: Bvh over the bodies, grouped by world
        surface: Bvh over the triangles, grouped by body
        near: the bodies that may touch a body, ``kernels.near.Near``
        key: hash of each vertex' cell, -1 for none, shape (n_vert,)
        cell_start: first vertex of each cell, shape (n_cell + 1,)
        cell_vert: vertices by cell, shape (n_vert,)
        candidates: what may touch
        hit_at: hits before each candidate vertex, shape (capacity.verts + 1,)
        hit_vert, hit_body, hit_layer, hit_depth, hit_dir: the hits, shape (capacity.contacts,)
        crossing: contacts of candidate edges in any order, shape (capacity.contacts,)
        n_place: places taken, some of them no longer in use, shape (1,)
        n_new: contacts of edges that the last look found, without those held, shape (1,)
        place: that of the first of each candidate edge, shape (capacity.edges,)
        source: place of each contact of an edge, shape (capacity.contacts,)
        stirred, served: the last sweep that changed the velocity of a vertex, and that added
            anything to it, shape (n_vert,)
        crossing_at: contacts before each candidate edge, shape (capacity.edges + 1,)
        layer: layer of the propagation, shape (1,)
        pending: whether it goes on, shape (1,)
        contacts: the contact records
        none: zero, shape (1,)
        n_hit, n_crossing: views of the last entries of ``hit_at`` and ``crossing_at``
        done: sweeps over the contacts so far, shape (1,)
        again: whether another is needed, shape (1,)
        found: whether any overlap is to be closed, and to be searched, shape (2,)
        deep_found: whether it had anything to search since the frame began, shape (1,)
        s: displacement vectors [m], shape (n_vert,)
        area: areas of comparison [m^2], shape (n_vert,)
        before, now: tractions before stage 4 and at a trial [Pa], shape (n_vert,)
        stiffness: traction gained over the whole of s [Pa], shape (n_vert,)
        fraction: part of s, shape (n_vert,)
        upper_mean, lower_mean: both sides of each contact, shape (capacity.contacts,)
        warm: the impulses of the last step
        impulse: received by each vertex since the frame began [N s], shape (n_vert,)
        pair_key: bodies of a pair with a contact force, shape (capacity.pairs,)
        pair_total: its impulse since the frame began, in units, shape (capacity.pairs, 3)
    """

    capacity: Capacity
    dt: wp.array
    share: wp.array
    steps: wp.array
    awake: Awake
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
    near: Near
    key: wp.array
    cell_start: wp.array
    cell_vert: wp.array
    candidates: Candidates
    hit_at: wp.array
    hit_vert: wp.array
    hit_body: wp.array
    hit_layer: wp.array
    hit_depth: wp.array
    hit_dir: wp.array
    crossing: wp.array
    n_place: wp.array
    n_new: wp.array
    place: wp.array
    source: wp.array
    stirred: wp.array
    served: wp.array
    crossing_at: wp.array
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
    warm: Warm
    impulse: wp.array
    pair_key: wp.array
    pair_total: wp.array


def everything(model: Model) -> Awake:
    """Nothing sleeps."""
    return Awake(
        bodies=wp.full(model.n_body, 1, dtype=int),
        tets=wp.full(model.n_tet, 1, dtype=int),
        inv_mass=model.inv_mass,
    )


def allocate_work(
    model: Model, state: State, capacity: Capacity, awake: Awake | None = None
) -> Work:
    """Room for a step on the current device; the Bvhs are built around ``state.x``."""
    n, m = model.n_vert, capacity.contacts
    lower, upper = _vectors(model.n_body), _vectors(model.n_body)
    tri_lower, tri_upper = _vectors(model.n_tri), _vectors(model.n_tri)
    n_near = wp.full(model.n_body, 1, dtype=int)
    candidates = _allocate_candidates(model, capacity)
    hit_at, crossing_at = _ints(capacity.verts + 1), _ints(capacity.edges + 1)
    launch_body_boxes(model, state.x, candidates.skin, lower, upper)
    launch_triangle_boxes(model, state.x, candidates.skin, n_near, tri_lower, tri_upper)
    bodies = wp.Bvh(lower, upper, groups=model.body_world)
    near = _allocate_near(model, bodies, lower, upper, n_near)
    return Work(
        capacity=capacity,
        dt=wp.zeros(1, dtype=float),
        share=wp.full(1, 1.0, dtype=float),
        steps=wp.zeros(1, dtype=int),
        awake=awake or everything(model),
        mask=_ints(model.n_tet),
        f_tet=wp.zeros(4 * model.n_tet, dtype=wp.vec3),
        x=_vectors(n),
        v=_vectors(n),
        lower=lower,
        upper=upper,
        tri_lower=tri_lower,
        tri_upper=tri_upper,
        bodies=bodies,
        surface=wp.Bvh(tri_lower, tri_upper, groups=model.tri_body, leaf_size=LEAF),
        near=near,
        key=_ints(n),
        cell_start=_ints(2 * n + 2),
        cell_vert=_ints(n),
        candidates=candidates,
        hit_at=hit_at,
        hit_vert=_ints(m),
        hit_body=_ints(m),
        hit_layer=_ints(m),
        hit_depth=_floats(m),
        hit_dir=_vectors(m),
        crossing=wp.zeros(m, dtype=EdgeContact),
        n_place=_ints(1),
        n_new=_ints(1),
        place=_ints(capacity.edges),
        source=_ints(m),
        stirred=_ints(n),
        served=_ints(n),
        crossing_at=crossing_at,
        layer=_ints(1),
        pending=_ints(1),
        contacts=_allocate_contacts(n, m),
        none=_ints(1),
        n_hit=hit_at[capacity.verts :],
        n_crossing=crossing_at[capacity.edges :],
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
        warm=allocate(n, m),
        impulse=_vectors(n),
        pair_key=wp.full(capacity.pairs, -1, dtype=wp.int64),
        pair_total=wp.zeros((capacity.pairs, 3), dtype=wp.int64),
    )


def launch_body_boxes(
    model: Model, x: wp.array, skin: wp.array, lower: wp.array, upper: wp.array
) -> None:
    """Set the boxes of the bodies, grown by their skins [m], shape (n_body,)."""
    wp.launch(bounds.clear_boxes, dim=model.n_body, inputs=[], outputs=[lower, upper])
    wp.launch(
        bounds.body_boxes,
        dim=-(-model.n_surf // int(bounds.CHUNK)),
        inputs=[model.surf, model.vert_body, skin, x],
        outputs=[lower, upper],
    )


def launch_triangle_boxes(
    model: Model,
    x: wp.array,
    skin: wp.array,
    n_near: wp.array,
    lower: wp.array,
    upper: wp.array,
) -> None:
    """Set the boxes of the triangles of bodies near another, grown by the skins [m]."""
    wp.launch(
        bounds.triangle_boxes,
        dim=model.n_tri,
        inputs=[model.tris, model.tri_body, n_near, model.body_edge, skin, x],
        outputs=[lower, upper],
    )


def _allocate_near(
    model: Model, bodies: wp.Bvh, lower: wp.array, upper: wp.array, n_near: wp.array
) -> Near:
    shape = model.n_body, int(MANY)
    near = Near()
    near.bodies, near.world = bodies.id, model.body_world
    near.lower, near.upper = lower, upper
    near.n_near, near.near = n_near, wp.zeros(shape, dtype=int)
    near.slab, near.end = wp.zeros(shape, dtype=wp.vec4), wp.zeros(shape, dtype=float)
    near.vert_lower, near.vert_upper = (wp.zeros(shape, dtype=wp.vec3) for _ in range(2))
    near.tri_lower, near.tri_upper = (wp.zeros(shape, dtype=wp.vec3) for _ in range(2))
    near.tris = wp.zeros(shape, dtype=wp.vec2i)
    return near


def _allocate_candidates(model: Model, capacity: Capacity) -> Candidates:
    return Candidates(
        x=_vectors(model.n_vert),
        free=_floats(model.n_body),
        skin=_floats(model.n_body),
        motion=_floats(model.n_body),
        pace=_floats(model.n_body),
        fastest=_floats(1),
        total=_ints(1),
        stale=wp.full(1, 1, dtype=int),
        edge=float(model.body_edge.numpy().min()),
        verts=_allocate_pairs(model.n_vert, capacity.verts, capacity.tets),
        edges=_allocate_pairs(model.n_edge, capacity.edges, capacity.tris),
        some=_ints(1),
        last=_vectors(model.n_vert),
        way=_floats(model.n_body + model.n_plane),
        n_found=_ints(1),
        vert_tet=wp.zeros(capacity.tets, dtype=wp.vec2i),
        edge_tri=wp.zeros(capacity.tris, dtype=wp.vec2i),
        near_tri=_ints(capacity.near),
    )


def _allocate_pairs(n_owner: int, n_pair: int, n_item: int) -> Pairs:
    return Pairs(
        n=_ints(1),
        pair=wp.zeros(n_pair, dtype=wp.vec2i),
        start=_ints(n_owner + 1),
        items=wp.zeros(n_pair, dtype=wp.vec2i),
        item=_ints(n_item),
        item_start=_ints(n_owner + 1),
        wake=_floats(n_pair),
    )


def _allocate_contacts(n: int, m: int) -> Contacts:
    return Contacts(
        n=_ints(1),
        needed=_ints(7),
        vert=wp.zeros((m, 5), dtype=int),
        coef=wp.zeros((m, 5), dtype=float),
        normal=_vectors(m),
        depth=_floats(m),
        offset=_floats(m),
        pair=wp.zeros(m, dtype=wp.vec2i),
        start=_ints(n + 1),
        entry=_ints(5 * m),
        n_touched=_ints(1),
        touched=_ints(n),
        weight=_floats(m),
        coupled=_floats(m),
        closing=_floats(m),
        open=_floats(m),
        turn=wp.zeros((m, 5), dtype=wp.vec3),
        lam=_floats(m),
        slip=_vectors(m),
        ahead=wp.zeros(m, dtype=wp.vec4),
        mu=_floats(m),
        ramp=_vectors(m),
        part=_vectors(5 * m),
        busy=_ints(m),
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
