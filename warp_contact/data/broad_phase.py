"""The pairs of the broad phase, which hold for many steps."""

from dataclasses import dataclass

import warp as wp

from warp_contact.data import boxes
from warp_contact.data.model import Model
from warp_contact.data.overflow import Capacity
from warp_contact.kernels.broad_phase.near import MANY, Near, NearPart
from warp_contact.kernels.broad_phase.pairs import PairList
from warp_contact.kernels.narrow_phase.apart import Apart
from warp_contact.kernels.narrow_phase.beside import Beside, few_tris

LEAF = 8  # triangles in a leaf: a query for the few near a vertex takes a quarter less than with 1


@dataclass
class Travel:
    """How far bodies have moved from one detection pass to the next.

    Attributes:
        last: positions of the last pass [m], shape (n_vert,)
        motion: largest motion of each body since then [m], shape (n_body,)
        recent: largest of the last motions, older ones count less [m], shape (n_body,)
        travelled: sum of the motions since the pairs were found [m], shape (n_body + n_plane,)
    """

    last: wp.array[wp.vec3]
    motion: wp.array[float]
    recent: wp.array[float]
    travelled: wp.array[float]


@dataclass
class Pairs:
    """Vertices (or edges) and the bodies whose tets (or triangles) they may come to meet.

    Attributes:
        list: the pairs and their items
        item_start: first item of each owner, shape (n_owner + 1,)
        clear_until: distance travelled by both bodies, before which they do not meet [m],
            shape (capacity,)
        travel: of the bodies between the passes over these pairs. Vertices are looked at where
            they would go without contact, edges where impulses lead: bodies at rest swing between
            the two, though the places of edges hardly change
    """

    list: PairList
    item_start: wp.array[int]
    clear_until: wp.array[float]
    travel: Travel

    @property
    def n(self) -> wp.array[int]:
        """Number of pairs, shape (1,)."""
        return self.list.n


@dataclass
class BroadPhase:
    """What may touch as long as no vertex is further than the skin of its body from ``x``.

    Attributes:
        x: half way of the step in which the pairs were found [m], shape (n_vert,)
        free: how far from ``x`` a prediction may be [m], shape (n_body,)
        skin: how far from ``x`` the pairs hold [m], shape (n_body,)
        age: steps since the pairs were found, shape (1,)
        drift: largest motion of each body since the pairs before were found [m], shape (n_body,)
        rate: motion of each body in a step, when they were found [m], shape (n_body,)
        fastest: largest of the predicted motions then [m], shape (1,)
        total: sum of the rates, in counts of skins.py, shape (1,)
        stale: whether the pairs have to be found again, shape (1,)
        verts: vertices and bodies with tets; a plane is a body with one tet
        edges: surface edges and bodies with triangles
        apart: what separates the latter, until they are found again
        beside: triangles beside the former, as long
        any_pair: whether there are any, shape (1,)
        n_found: length of the list that is being filled, shape (1,)
        vert_tet, edge_tri: what was found in any order, shapes (capacity.tets,), (capacity.tris,):
            one after the other, in the same memory
        near: the bodies that may touch a body
        near_tri: triangles in the slabs of near bodies, shape (capacity.near,)
        lower, upper: boxes of the bodies [m], shape (n_body,)
        tri_lower, tri_upper: boxes of the triangles [m], shape (n_tri,)
        bodies: Bvh over the bodies, grouped by world
        surface: Bvh over the triangles, grouped by body
        key: hash of each vertex' cell, -1 for none, shape (n_vert,)
        cell_start: first vertex of each cell, shape (n_cell + 1,)
        cell_vert: vertices by cell, shape (n_vert,)
    """

    x: wp.array[wp.vec3]
    free: wp.array[float]
    skin: wp.array[float]
    age: wp.array[int]
    drift: wp.array[float]
    rate: wp.array[float]
    fastest: wp.array[float]
    total: wp.array[int]
    stale: wp.array[int]
    verts: Pairs
    edges: Pairs
    apart: Apart
    beside: Beside
    any_pair: wp.array[int]
    n_found: wp.array[int]
    vert_tet: wp.array[wp.vec2i]
    edge_tri: wp.array[wp.vec2i]
    near: Near
    near_tri: wp.array[int]
    lower: wp.array[wp.vec3]
    upper: wp.array[wp.vec3]
    tri_lower: wp.array[wp.vec3]
    tri_upper: wp.array[wp.vec3]
    bodies: wp.Bvh
    surface: wp.Bvh
    key: wp.array[int]
    cell_start: wp.array[int]
    cell_vert: wp.array[int]


def allocate(model: Model, x: wp.array[wp.vec3], capacity: Capacity) -> BroadPhase:
    """Allocate without any pair; the Bvhs are built around ``x``."""
    n, n_body = model.n_vert, model.n_body
    trees = _trees(model, x)
    found = wp.zeros(max(capacity.tets, capacity.tris), dtype=wp.vec2i)
    return BroadPhase(
        x=wp.zeros(n, dtype=wp.vec3),
        free=wp.zeros(n_body, dtype=float),
        skin=wp.zeros(n_body, dtype=float),
        age=wp.zeros(1, dtype=int),
        drift=wp.zeros(n_body, dtype=float),
        rate=wp.zeros(n_body, dtype=float),
        fastest=wp.zeros(1, dtype=float),
        total=wp.zeros(1, dtype=int),
        stale=wp.full(1, 1, dtype=int),
        verts=_pairs(model, n, capacity.verts, capacity.tets),
        edges=_pairs(model, model.n_edge, capacity.edges, capacity.tris),
        apart=_apart(capacity),
        beside=_beside(capacity),
        any_pair=wp.zeros(1, dtype=int),
        n_found=wp.zeros(1, dtype=int),
        vert_tet=found[: capacity.tets],
        edge_tri=found[: capacity.tris],
        near_tri=wp.zeros(capacity.near, dtype=int),
        key=wp.zeros(n, dtype=int),
        cell_start=wp.zeros(2 * n + 2, dtype=int),
        cell_vert=wp.zeros(n, dtype=int),
        **trees,
    )


def _trees(model: Model, x: wp.array[wp.vec3]) -> dict:
    """Boxes of bodies and triangles at ``x``, the Bvhs over them, and the lists of near bodies."""
    skin, n_near = wp.zeros(model.n_body, dtype=float), wp.full(model.n_body, 1, dtype=int)
    lower, upper = (wp.zeros(model.n_body, dtype=wp.vec3) for _ in range(2))
    tri_lower, tri_upper = (wp.zeros(model.n_tri, dtype=wp.vec3) for _ in range(2))
    boxes.of_bodies(model, x, skin, lower, upper)
    boxes.of_triangles(model, x, skin, n_near, tri_lower, tri_upper)
    bodies = wp.Bvh(lower, upper, groups=model.body_world)
    return {
        "lower": lower,
        "upper": upper,
        "tri_lower": tri_lower,
        "tri_upper": tri_upper,
        "bodies": bodies,
        "surface": wp.Bvh(tri_lower, tri_upper, groups=model.tri_body, leaf_size=LEAF),
        "near": _near(model, bodies, lower, upper, n_near),
    }


def _near(
    model: Model,
    bodies: wp.Bvh,
    lower: wp.array[wp.vec3],
    upper: wp.array[wp.vec3],
    n_near: wp.array[int],
) -> Near:
    shape = model.n_body, int(MANY)
    near = Near()
    near.bodies, near.world = bodies.id, model.body_world
    near.lower, near.upper = lower, upper
    near.n_near, near.other = n_near, wp.zeros(shape, dtype=int)
    near.slab, near.end = wp.zeros(shape, dtype=wp.vec4), wp.zeros(shape, dtype=float)
    near.part = wp.zeros(shape, dtype=NearPart)
    return near


def _pairs(model: Model, n_owner: int, n_pair: int, n_item: int) -> Pairs:
    pairs = PairList()
    pairs.n = wp.zeros(1, dtype=int)
    pairs.pair = wp.zeros(n_pair, dtype=wp.vec2i)
    pairs.start = wp.zeros(n_owner + 1, dtype=int)
    pairs.items = wp.zeros(n_pair, dtype=wp.vec2i)
    pairs.item = wp.zeros(n_item, dtype=int)
    return Pairs(
        list=pairs,
        item_start=wp.zeros(n_owner + 1, dtype=int),
        clear_until=wp.zeros(n_pair, dtype=float),
        travel=Travel(
            last=wp.zeros(model.n_vert, dtype=wp.vec3),
            motion=wp.zeros(model.n_body, dtype=float),
            recent=wp.zeros(model.n_body, dtype=float),
            travelled=wp.zeros(model.n_body + model.n_plane, dtype=float),
        ),
    )


def _apart(capacity: Capacity) -> Apart:
    apart = Apart()
    apart.gap = wp.zeros(capacity.edges, dtype=float)
    apart.axis = wp.zeros(capacity.tris, dtype=wp.int8)
    return apart


def _beside(capacity: Capacity) -> Beside:
    beside = Beside()
    beside.until = wp.zeros(capacity.verts, dtype=float)
    beside.n = wp.zeros(capacity.verts, dtype=int)
    beside.tri = wp.zeros(capacity.verts, dtype=few_tris)
    return beside
