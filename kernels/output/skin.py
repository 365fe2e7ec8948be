"""A fine surface that follows coarse tets.

    p = sum of w_k x_k          the corners x_k of the tet that holds the point at rest        [m]
    n ~ cof(F) n_0              F the deformation gradient of the tet                          [-]

A point that no tet holds belongs to the one from whose faces it sticks out least, and some of its
w_k are negative.
"""

import warp as wp

from warp_contact.kernels.elastic import tet as element
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def weights(p: wp.vec3, t: wp.vec4i, pose: wp.mat33, y: wp.array[wp.vec3]) -> wp.vec4:
    w = pose * (p - y[t[0]])
    return wp.vec4(1.0 - w[0] - w[1] - w[2], w[0], w[1], w[2])


@wp.func
def sticks_out(w: wp.vec4, pose: wp.mat33) -> float:
    """How far [m] a point of weights w is outside the face from which it is furthest."""
    a = wp.vec3(pose[0, 0], pose[0, 1], pose[0, 2])
    b = wp.vec3(pose[1, 0], pose[1, 1], pose[1, 2])
    c = wp.vec3(pose[2, 0], pose[2, 1], pose[2, 2])
    out = wp.max(-w[1] / wp.length(a), -w[2] / wp.length(b))
    return wp.max(wp.max(out, -w[3] / wp.length(c)), -w[0] / wp.length(a + b + c))


@wp.kernel
def find_tets(
    # in
    tets: wp.array[wp.vec4i],  # (n_tet,)
    pose: wp.array[wp.mat33],  # (n_tet,) [1/m]
    y: wp.array[wp.vec3],  # (n_vert,) [m] at rest
    p: wp.array[wp.vec3],  # (n_point,) [m]
    # out
    tet: wp.array[int],  # (n_point,)
    weight: wp.array[wp.vec4],  # (n_point,)
):
    """One thread per point: the tet that holds it."""
    i = wp.tid()
    least = float(wp.inf)
    for q in range(tets.shape[0]):
        w = weights(p[i], tets[q], pose[q], y)
        out = sticks_out(w, pose[q])
        if out < least:
            least = out
            tet[i] = q
            weight[i] = w
        if out <= 0.0:
            return


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
