"""Stage 4, depth: the contact of each vertex inside a body with a triangle, or with a plane.

The contact point is where the ray from the vertex along its direction leaves the body (Spillmann &
Teschner 2005, section 3.2). The distance to it replaces the depth. In two cases the closest point
of the surface serves instead. First, if there is no direction, or the ray is much longer than the
depth. Second, if bodies were apart when the step began, but this contact would have overlapped
then, and that of the closest point less: the vertex came in by another side. If the latter would
have overlapped too, close to a rim, the vertex goes back through the triangle by which it came in.

A vertex outside, in the speculative margin, makes a contact with a gap. The impulses then see it
before it closes, so that a resting body stays in contact in every step and its contact force is
steady.

Triangle and direction are those at the predicted positions. The weights are those at the start of
the step x0, seen along the direction: sum a_k x0_k is then parallel to the normal impulse, which
keeps the angular momentum, since L = sum m x0 x v for symplectic Euler.
"""

import warp as wp

from warp_contact.kernels.geometry import projected_weights
from warp_contact.kernels.lengths import FLUSH, NEAR_WALL, STALE_OVERLAP, VERTEX_MARGIN
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.narrow_phase.opposing import along, closest_opposing, looks
from warp_contact.kernels.narrow_phase.surface_query import (
    Hit,
    closest_hit,
    face_normal,
    hit_point,
    inner_side,
    leaving_hit,
)
from warp_contact.kernels.narrow_phase.vertices import ABOVE, BELOW, BEYOND, Penetration, entry_of
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import Worlds

wp.set_module_options(OPTIONS)

SLIP = wp.constant(1.0)  # change of the weights in a step, above which those at its end are used
BESIDE = wp.constant(0.1)  # weights: a ray from just inside must leave this close to the vertex
TRUSTED = wp.constant(3.0)  # a ray this many times longer than the depth is not trusted
ASTRAY = wp.constant(2.0)  # nor is a way back this many times longer than the motion in the step


@wp.struct
class VertexContact:
    found: bool
    hit: Hit
    n: wp.vec3
    start: float  # gap at the start of the step [m]


@wp.func
def contact_at(
    hit: Hit, i: int, n: wp.vec3, tris: wp.array[wp.vec3i], x0: wp.array[wp.vec3]
) -> VertexContact:
    """The contact of vertex i with the point of a hit, along n."""
    out = VertexContact()
    out.found = True
    out.hit = hit
    out.n = n
    out.start = wp.dot(x0[i] - hit_point(hit, tris, x0), n)
    return out


@wp.func
def inner_contact(
    surface: wp.uint64,
    root: int,
    tris: wp.array[wp.vec3i],
    x0: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
    e: Penetration,
    edge: float,  # [m]
) -> VertexContact:
    """The contact where the ray of a vertex along its direction leaves the body."""
    out = VertexContact()
    i = e.vert
    r = e.direction
    if e.layer < 0 or e.depth <= 0.0:
        return out
    ray = e.hit
    if e.side != BELOW or ray.tri < 0:
        ray = leaving_hit(surface, root, tris, x, x[i], r)
    if ray.tri < 0:  # in the margin, outside the body: cast it from just inside
        near = closest_hit(surface, root, tris, x, x[i], 0.1 * edge)
        inner = hit_point(near, tris, x) - 2.0 * VERTEX_MARGIN * edge * face_normal(
            tris[near.tri], x
        )
        ray = leaving_hit(surface, root, tris, x, inner, r)
        if ray.tri >= 0:
            ray.t = wp.dot(hit_point(ray, tris, x) - x[i], r)
            t = tris[ray.tri]
            own = projected_weights(x[i], r, x[t[0]], x[t[1]], x[t[2]])
            if wp.length(own - ray.w) > BESIDE:
                return out
    if ray.tri >= 0 and ray.t > 0.0 and ray.t <= TRUSTED * e.depth + NEAR_WALL * edge:
        out = contact_at(ray, i, r, tris, x0)
    return out


@wp.func
def closest_contact(
    surface: wp.uint64,
    root: int,
    tris: wp.array[wp.vec3i],
    vs_start: wp.array[int],
    vs_tri: wp.array[int],
    x0: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
    e: Penetration,
    edge: float,  # [m]
) -> VertexContact:
    """The contact of a vertex with the closest point of the surface."""
    out = VertexContact()
    i = e.vert
    margin = 2.0 * VERTEX_MARGIN * edge
    near = e.hit
    if e.side != ABOVE:
        near = closest_hit(surface, root, tris, x, x[i], 0.1 * edge)
        if inner_side(near, tris, x, x[i]) <= FLUSH * edge:
            near = closest_opposing(surface, root, tris, vs_start, vs_tri, x, i, margin)
    elif near.t >= margin:
        return out
    if near.tri < 0:
        return out
    n = face_normal(tris[near.tri], x)
    if near.t < NEAR_WALL * edge and along(looks(i, n, tris, vs_start, vs_tri, x)):
        return out
    gap = hit_point(near, tris, x) - x[i]
    if wp.dot(gap, n) > 0.0:
        n = wp.normalize(gap)
    return contact_at(near, i, n, tris, x0)


@wp.func
def entry_contact(
    surface: wp.uint64,
    root: int,
    tris: wp.array[wp.vec3i],
    x0: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
    i: int,
    edge: float,  # [m]
    beyond: bool,
) -> VertexContact:
    """The contact of vertex i with the triangle by which it came in since the step began.

    The motion is relative to the closest point of the surface, as the body may move too.
    """
    out = VertexContact()
    near = closest_hit(surface, root, tris, x, x[i], 0.1 * edge)
    if not beyond and inner_side(near, tris, x, x[i]) <= 0.0:
        return out
    entry = entry_of(near, surface, root, tris, x0, x, i)
    if entry.hit.tri >= 0 and entry.hit.t <= ASTRAY * entry.back:
        out = contact_at(entry.hit, i, face_normal(tris[entry.hit.tri], x), tris, x0)
    return out


@wp.func
def found_contact(
    e: Penetration,
    apart: bool,
    mesh: Mesh,
    x0: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
) -> VertexContact:
    """The contact of a penetration with a triangle, if there is any."""
    i = e.vert
    edge = mesh.body_edge[e.body]
    stale = -STALE_OVERLAP * edge
    root = wp.bvh_get_group_root(mesh.bvh, e.body)
    if e.side == BEYOND:
        return entry_contact(mesh.bvh, root, mesh.tris, x0, x, i, edge, True)
    out = inner_contact(mesh.bvh, root, mesh.tris, x0, x, e, edge)
    if not out.found or (apart and out.start < stale):
        near = closest_contact(
            mesh.bvh, root, mesh.tris, mesh.vs_start, mesh.vs_tri, x0, x, e, edge
        )
        if near.found and not (out.found and out.start >= near.start):
            out = near
    if out.found and apart and out.start < stale:
        entry = entry_contact(mesh.bvh, root, mesh.tris, x0, x, i, edge, False)
        if entry.found and entry.start >= stale:
            out = entry
    return out


@wp.kernel
def vertex_contacts(
    # in
    threads: int,
    worlds: Worlds,
    mesh: Mesh,
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    n_inside: wp.array[int],  # (1,) penetrations
    penetration: wp.array[Penetration],  # (capacity,)
    # out
    contact: wp.array[Contact],  # (capacity,)
):
    """For each penetration of a surface vertex: its contact with a triangle or a plane."""
    for e in range(wp.tid(), wp.min(n_inside[0], contact.shape[0]), threads):
        i = penetration[e].vert
        body = penetration[e].body
        to = Contact()
        for k in range(5):
            to.vert[k] = i
        to.pair = wp.vec2i(mesh.vert_body[i], body)
        to.edge_length = mesh.body_edge[mesh.vert_body[i]]
        to.on_plane = body >= mesh.n_body
        if to.on_plane:
            n = mesh.plane_n[body - mesh.n_body]
            to.coef[0] = 1.0
            to.normal = n
            to.offset = mesh.plane_h[body - mesh.n_body]
            to.depth = to.offset - wp.dot(n, x[i])
        elif mesh.on_surface[i] != 0:
            apart = worlds.apart[worlds.of_vert[i]] != 0
            out = found_contact(penetration[e], apart, mesh, x0, x)
            if out.found:
                t = mesh.tris[out.hit.tri]
                r = out.n
                w = projected_weights(x0[i], r, x0[t[0]], x0[t[1]], x0[t[2]])
                if wp.length(w - out.hit.w) > SLIP:
                    w = out.hit.w
                to.coef[0] = 1.0
                for k in range(3):
                    to.vert[2 + k] = t[k]
                    to.coef[2 + k] = -w[k]
                to.normal = r
                to.depth = wp.dot(hit_point(out.hit, mesh.tris, x) - x[i], r)
        contact[e] = to
