"""Stage 4, depth: that of a vertex just below, or just above, a smooth part of a surface.

Below a smooth part, the tet edges that lead out cross it next to the closest point x_c. The sums of
depth.py are then, but for terms of the order of the depth,

    d(p) = (x_c - p) . n_c            depth [m]
    r(p) = n_c                        averaged normal at x_c

and no edge is followed. An edge at the sine s to the surface has a weight of s^2 / d^2 in these
sums. An outer neighbour behind the plane of the triangle leads out elsewhere, with a weight of at
most 1 / reach^2 if all that the vertex opposes within reach is smooth. Let k edges do so; then

    k d^2 <= SAME reach^2 sum s^2

keeps the direction within about SAME of that of the edges. All else is left to the edges: rims,
wedges, the far side of a thin body, and what is deeper than the reach.

A vertex in front of all triangles within reach is outside, in the speculative margin: its edges
cross nothing, and it has no depth.
"""

import warp as wp

from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.narrow_phase.beside import MOST, Beside, few_tris
from warp_contact.kernels.narrow_phase.opposing import looks_against
from warp_contact.kernels.narrow_phase.surface_query import (
    CREASE,
    Hit,
    closer,
    corner_normals,
    face_normal,
    hit_point,
    leaves_earlier,
)
from warp_contact.kernels.narrow_phase.vertices import (
    ABOVE,
    BELOW,
    Penetration,
    is_inside_of,
)
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

SAME = wp.constant(0.02)  # weight of edges that may lead out elsewhere
STRAIGHT = wp.constant(0.99)  # cosine: a closest point further aside is at a rim


@wp.struct
class Place:
    """Where a vertex lies against the triangles within reach."""

    side: int
    hit: Hit  # the closest point of those that the vertex opposes
    n: wp.vec3  # normal there
    n_near: int
    near: few_tris
    above: bool  # in front of all
    smooth: bool  # all that the vertex opposes look about the same way


@wp.func
def with_near(
    place: Place,
    k: int,
    i: int,
    reach: float,  # [m]
    mesh: Mesh,
    x: wp.array[wp.vec3],
) -> Place:
    """The place of vertex i, with triangle k included if it is within reach."""
    out = place
    within = Hit()
    within.tri = -1
    within.t = reach
    p = x[i]
    at = closer(within, k, mesh.tris, x, p)
    if at.tri < 0:
        return out
    if out.n_near < MOST:
        out.near[out.n_near] = k
    out.n_near += 1
    own = face_normal(mesh.tris[k], x)
    out.above = out.above and wp.dot(hit_point(at, mesh.tris, x) - p, own) <= 0.0
    if looks_against(i, own, mesh.tris, mesh.vs_start, mesh.vs_tri, x):
        out.smooth = out.smooth and (out.hit.tri < 0 or wp.dot(own, out.n) > CREASE)
        if at.t < out.hit.t or (at.t == out.hit.t and k < out.hit.tri):
            out.hit = at
            out.n = own
    return out


@wp.func
def place_of(
    e: Penetration,
    root: int,
    reach: float,  # [m]
    mesh: Mesh,
    x: wp.array[wp.vec3],
    beside: Beside,
) -> Place:
    """Where a vertex lies; BELOW if all triangles that it opposes look about the same way."""
    out = Place()
    out.hit.tri = -1
    out.hit.t = reach
    out.above = True
    out.smooth = True
    p = x[e.vert]
    n = beside.n[e.pair]
    if n <= MOST:
        for m in range(n):
            out = with_near(out, beside.tri[e.pair][m], e.vert, reach, mesh, x)
    else:
        k = int(0)
        grow = wp.vec3(reach, reach, reach)
        query = wp.bvh_query_aabb(mesh.bvh, p - grow, p + grow, root)
        while wp.bvh_query_next(query, k):
            out = with_near(out, k, e.vert, reach, mesh, x)
    if out.n_near > 0 and out.above:
        out.side = ABOVE
    elif out.hit.tri >= 0 and out.smooth and out.n_near <= MOST:
        if wp.dot(hit_point(out.hit, mesh.tris, x) - p, out.n) > STRAIGHT * out.hit.t:
            out.side = BELOW
    return out


@wp.func
def lead_out_here(
    i: int,
    body: int,
    n: wp.vec3,
    part: float,  # depth over reach
    mesh: Mesh,
    x: wp.array[wp.vec3],
    pair_start: wp.array[int],
    inside_at: wp.array[int],
    penetration: wp.array[Penetration],
) -> bool:
    """Whether the tet edges of vertex i that lead out of the body do so next to it."""
    here = float(0.0)
    elsewhere = float(0.0)
    for k in range(mesh.vn_start[i], mesh.vn_start[i + 1]):
        j = mesh.vn_vert[k]
        u = x[j] - x[i]
        s = wp.dot(u, n)
        if s > 0.0:
            here += s * s / wp.length_sq(u)
        elif not is_inside_of(j, body, pair_start, inside_at, penetration):
            elsewhere += 1.0
    return here > 0.0 and elsewhere * part * part <= SAME * here


@wp.func
def shallow_depth(
    e: Penetration,
    place: Place,
    reach: float,  # [m]
    mesh: Mesh,
    x: wp.array[wp.vec3],
    pair_start: wp.array[int],
    inside_at: wp.array[int],
    penetration: wp.array[Penetration],
) -> Penetration:
    """The penetration of a vertex BELOW, with depth and direction if they are those of edges."""
    p = x[e.vert]
    t = mesh.tris[place.hit.tri]
    normals = corner_normals(t, mesh.tris, mesh.vs_start, mesh.vs_tri, x)
    n = wp.normalize(normals * place.hit.w)
    d = wp.dot(hit_point(place.hit, mesh.tris, x) - p, n)
    if d <= 0.0 or not looks_against(e.vert, n, mesh.tris, mesh.vs_start, mesh.vs_tri, x):
        return e
    face = face_normal(t, x)
    part = place.hit.t / reach
    if lead_out_here(e.vert, e.body, face, part, mesh, x, pair_start, inside_at, penetration):
        e.depth = d
        e.direction = n
        e.layer = 0
        e.side = BELOW
        e.hit.t = reach
        for k in range(place.n_near):
            e.hit = leaves_earlier(e.hit, place.near[k], mesh.tris, x, p, n)
    return e
