"""A fine surface that follows coarse tets.

    p = sum of w_k x_k          the corners x_k of the tet that holds the point at rest        [m]
    n ~ cof(F) n_0              F the deformation gradient of the tet                          [-]

A point that no tet holds belongs to that of the nearest triangle of the tets, and some of its w_k
are negative.
"""

import warp as wp

from warp_contact.kernels.elastic import tet as element
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

ROUNDING = wp.constant(1.0e-5)  # of weights: a point between two tets is in one of them
FAR = wp.constant(1.0e30)  # [m]


@wp.func
def weights(p: wp.vec3, t: wp.vec4i, pose: wp.mat33, y: wp.array[wp.vec3]) -> wp.vec4:
    w = pose * (p - y[t[0]])
    return wp.vec4(1.0 - w[0] - w[1] - w[2], w[0], w[1], w[2])


@wp.kernel
def find_tets(
    # in
    boxes: wp.uint64,  # of the tets
    surface: wp.uint64,  # a mesh of their surface
    tet_of: wp.array[int],  # (n_tri,) tet of each triangle
    tets: wp.array[wp.vec4i],  # (n_tet,)
    pose: wp.array[wp.mat33],  # (n_tet,) [1/m]
    y: wp.array[wp.vec3],  # (n_vert,) [m] at rest
    p: wp.array[wp.vec3],  # (n_point,) [m]
    # out
    tet: wp.array[int],  # (n_point,)
    weight: wp.array[wp.vec4],  # (n_point,)
):
    """One thread per point: its tet."""
    i = wp.tid()
    best = float(-ROUNDING)
    tet[i] = -1
    q = int(0)
    query = wp.bvh_query_aabb(boxes, p[i], p[i])
    while wp.bvh_query_next(query, q):
        least = wp.min(weights(p[i], tets[q], pose[q], y))
        if least > best or (least == best and q < tet[i]):
            best = least
            tet[i] = q
    if tet[i] < 0:
        near = wp.mesh_query_point_no_sign(surface, p[i], FAR)
        tet[i] = tet_of[near.face]
    weight[i] = weights(p[i], tets[tet[i]], pose[tet[i]], y)


@wp.kernel
def place(
    # in
    tets: wp.array[wp.vec4i],  # (n_tet,) over x
    tet: wp.array[int],  # (n_point,)
    weight: wp.array[wp.vec4],  # (n_point,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    p: wp.array[wp.vec3],  # (n_point,) [m]
):
    """One thread per point: where it is."""
    i = wp.tid()
    t = tets[tet[i]]
    w = weight[i]
    p[i] = w[0] * x[t[0]] + w[1] * x[t[1]] + w[2] * x[t[2]] + w[3] * x[t[3]]


@wp.kernel
def turn_normals(
    # in
    tets: wp.array[wp.vec4i],  # (n_tet,) over x
    pose: wp.array[wp.mat33],  # (n_tet,) [1/m]
    tet: wp.array[int],  # (n_point,)
    point: wp.array[int],  # (n_corner,) of each corner
    normal: wp.array[wp.vec3],  # (n_corner,) at rest
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    n: wp.array[wp.vec3],  # (n_corner,) unit
):
    """One thread per corner: its normal, turned with the tet that holds its point."""
    c = wp.tid()
    q = tet[point[c]]
    f = element.rate(q, tets, pose, x)
    n[c] = wp.normalize(element.cof(f) * normal[c])


@wp.kernel
def sum_normals(
    # in
    tris: wp.array[wp.vec3i],  # (n_tri,)
    start: wp.array[int],  # (n_point + 1,) first entry of each point in ``around``
    around: wp.array[int],  # (3 n_tri,) triangles at each point
    p: wp.array[wp.vec3],  # (n_point,) [m]
    # out
    n: wp.array[wp.vec3],  # (n_point,) unit
):
    """One thread per point: the mean normal of its triangles, by their areas."""
    i = wp.tid()
    s = wp.vec3(0.0, 0.0, 0.0)
    for k in range(start[i], start[i + 1]):
        t = tris[around[k]]
        s += wp.cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]])
    n[i] = wp.normalize(s)
