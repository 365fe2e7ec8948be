"""The overlaps of a state, found without the hash and the depths of the step.

A vertex overlaps by its distance to the surface of the body whose tets contain it. An edge with
both ends outside overlaps by the distance of the middle of its inner piece to that surface.
"""

import warp as wp

from warp_contact.kernels.broad_phase.bounds import next_in
from warp_contact.kernels.geometry import tet_weights
from warp_contact.kernels.lengths import FLUSH
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.narrow_phase.surface_query import closest_hit, first_crossing, inner_side
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.ties.attachment import Partners, hang_together

wp.set_module_options(OPTIONS)


@wp.kernel
def tet_boxes(
    # in
    tets: wp.array[wp.vec4i],  # (n_tet,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    lower: wp.array[wp.vec3],  # (n_tet,) [m]
    upper: wp.array[wp.vec3],  # (n_tet,) [m]
):
    """One thread per tet: its box."""
    q = wp.tid()
    a = x[tets[q][0]]
    b = x[tets[q][1]]
    c = x[tets[q][2]]
    d = x[tets[q][3]]
    lower[q] = wp.min(wp.min(a, b), wp.min(c, d))
    upper[q] = wp.max(wp.max(a, b), wp.max(c, d))


@wp.kernel
def vertex_overlaps(
    # in
    volumes: wp.uint64,  # Bvh over the tets, grouped by world
    mesh: Mesh,
    surf: wp.array[int],  # (n_surf,)
    body_world: wp.array[int],  # (n_body,)
    partners: Partners,  # bodies that hang together do not meet
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    overlap: wp.array[float],  # (n_surf,) [m]
    partner: wp.array[int],  # (n_surf,) body, n_body + p for plane p, -1 for none
):
    """One thread per surface vertex: its deepest overlap."""
    k = wp.tid()
    i = surf[k]
    own = mesh.vert_body[i]
    p = x[i]
    overlap[k] = 0.0
    partner[k] = -1
    for m in range(mesh.plane_n.shape[0]):
        d = mesh.plane_h[m] - wp.dot(mesh.plane_n[m], p)
        if d > overlap[k]:
            overlap[k] = d
            partner[k] = mesh.n_body + m
    world = body_world[own]
    q = next_in(volumes, world, p, p, -1)
    while q >= 0:
        t = mesh.tets[q]
        body = mesh.vert_body[t[0]]
        least = wp.min(tet_weights(p, x[t[0]], x[t[1]], x[t[2]], x[t[3]]))
        met = body != own and not hang_together(partners, own, body)
        if met and least >= -FLUSH:  # rounding puts it out of all tets that share a face
            root = wp.bvh_get_group_root(mesh.bvh, body)
            hit = closest_hit(mesh.bvh, root, mesh.tris, x, p, 0.1 * mesh.body_edge[body])
            flush = FLUSH * mesh.body_edge[body]
            inside = least >= 0.0 or inner_side(hit, mesh.tris, x, p) > flush
            if inside and hit.t > overlap[k]:
                overlap[k] = hit.t
                partner[k] = body
        q = next_in(volumes, world, p, p, q)


@wp.kernel
def edge_overlaps(
    # in
    bodies: wp.uint64,  # Bvh over the bodies, grouped by world
    mesh: Mesh,
    body_world: wp.array[int],  # (n_body,)
    partners: Partners,  # bodies that hang together do not meet
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    overlap: wp.array[float],  # (n_edge,) [m]
    partner: wp.array[int],  # (n_edge,) body, -1 for none
):
    """One thread per surface edge: the deepest middle of an inner piece."""
    e = wp.tid()
    i = mesh.edges[e][0]
    p = x[i]
    q = x[mesh.edges[e][1]]
    own = mesh.vert_body[i]
    overlap[e] = 0.0
    partner[e] = -1
    world = body_world[own]
    body = next_in(bodies, world, wp.min(p, q), wp.max(p, q), -1)
    while body >= 0:
        if body != own and not hang_together(partners, own, body):
            root = wp.bvh_get_group_root(mesh.bvh, body)
            piece = first_crossing(mesh.bvh, root, mesh.tris, x, p, q - p)
            if piece.enter.tri >= 0 and piece.leave.tri >= 0:
                middle = p + 0.5 * (piece.enter.t + piece.leave.t) * (q - p)
                reach = 0.1 * mesh.body_edge[body]
                hit = closest_hit(mesh.bvh, root, mesh.tris, x, middle, reach)
                if hit.t > overlap[e] and inner_side(hit, mesh.tris, x, middle) > 0.0:
                    overlap[e] = hit.t
                    partner[e] = body
        body = next_in(bodies, world, wp.min(p, q), wp.max(p, q), body)
