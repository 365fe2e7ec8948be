"""Boxes around bodies and triangles, grown by the skin (skins.py) to hold as long as the pairs.

Minimum and maximum do not depend on the order of their arguments, so atomics repeat bit for bit.
"""

import warp as wp

from warp_contact.kernels.lengths import BOX_GROWTH
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

CHUNK = wp.constant(64)  # vertices reduced by one thread before it touches the body's box


@wp.func
def next_in(boxes: wp.uint64, group: int, lo: wp.vec3, hi: wp.vec3, last: int) -> int:
    """The first box of a group after ``last`` that meets the one from lo to hi, or -1.

    For loops with queries inside: on a GPU all queries of a thread share one stack, so one has to
    end before another begins.
    """
    first = int(-1)
    item = int(0)
    query = wp.bvh_query_aabb(boxes, lo, hi, wp.bvh_get_group_root(boxes, group))
    while wp.bvh_query_next(query, item):
        if item > last and (first < 0 or item < first):
            first = item
    return first


@wp.kernel
def clear_boxes(
    # out
    lower: wp.array[wp.vec3],  # (n_body,) [m]
    upper: wp.array[wp.vec3],  # (n_body,) [m]
):
    """One thread per body: an empty box."""
    m = wp.tid()
    lower[m] = wp.vec3(1.0e30, 1.0e30, 1.0e30)
    upper[m] = wp.vec3(-1.0e30, -1.0e30, -1.0e30)


@wp.kernel
def body_boxes(
    # in
    surf: wp.array[int],  # (n_surf,)
    vert_body: wp.array[int],  # (n_vert,)
    skin: wp.array[float],  # (n_body,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    lower: wp.array[wp.vec3],  # (n_body,) [m]
    upper: wp.array[wp.vec3],  # (n_body,) [m]
):
    """One thread per CHUNK of surface vertices: grow the boxes of their bodies."""
    first = wp.tid() * CHUNK
    body = vert_body[surf[first]]
    lo = wp.vec3(1.0e30, 1.0e30, 1.0e30)
    hi = -lo
    for k in range(first, wp.min(first + CHUNK, surf.shape[0])):
        i = surf[k]
        if vert_body[i] != body:
            wp.atomic_min(lower, body, lo)
            wp.atomic_max(upper, body, hi)
            body = vert_body[i]
            lo = wp.vec3(1.0e30, 1.0e30, 1.0e30)
            hi = -lo
        grow = wp.vec3(skin[body], skin[body], skin[body])
        lo = wp.min(lo, x[i] - grow)
        hi = wp.max(hi, x[i] + grow)
    wp.atomic_min(lower, body, lo)
    wp.atomic_max(upper, body, hi)


@wp.kernel
def triangle_boxes(
    # in
    tris: wp.array[wp.vec3i],  # (n_tri,)
    tri_body: wp.array[int],  # (n_tri,)
    n_near: wp.array[int],  # (n_body,)
    body_edge: wp.array[float],  # (n_body,) [m]
    skin: wp.array[float],  # (n_body,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    lower: wp.array[wp.vec3],  # (n_tri,) [m]
    upper: wp.array[wp.vec3],  # (n_tri,) [m]
):
    """One thread per triangle of a body that is near another: its box, grown by the skin."""
    t = wp.tid()
    body = tri_body[t]
    if n_near[body] == 0:
        return
    a = x[tris[t][0]]
    b = x[tris[t][1]]
    c = x[tris[t][2]]
    g = skin[body] + BOX_GROWTH * body_edge[body]
    lower[t] = wp.min(wp.min(a, b), c) - wp.vec3(g, g, g)
    upper[t] = wp.max(wp.max(a, b), c) + wp.vec3(g, g, g)
