"""Boxes around bodies and triangles over a step, and the bodies that may touch.

Two bodies may touch when their boxes meet in a box B and either surface has a triangle there. Where
only one has, the other still may hold all of B: a body enclosed by another.

A box holds the start and the predicted end of a step: stage 2 asks at the prediction for vertices
and, once these are resolved, somewhere in between for edges. Minimum and maximum do not depend on
the order of their arguments, so atomics repeat bit for bit.
"""

import warp as wp

from warp_contact.kernels.geometry import boxes_meet
from warp_contact.kernels.surface_query import holds

wp.set_module_options({"enable_backward": False})

CHUNK = wp.constant(64)  # vertices reduced by one thread before it touches the body's box
HUGE = wp.constant(1.0e5)  # cells along a body: more is not a body any longer
GROW = wp.constant(1.0e-5)  # of an edge: a flat triangle's box must not vanish for a ray


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
    x0: wp.array[wp.vec3],  # (n_vert,) [m]
    x1: wp.array[wp.vec3],  # (n_vert,) [m]
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
        lo = wp.min(lo, wp.min(x0[i], x1[i]))
        hi = wp.max(hi, wp.max(x0[i], x1[i]))
    wp.atomic_min(lower, body, lo)
    wp.atomic_max(upper, body, hi)


@wp.kernel
def near_bodies(
    # in
    cell: float,  # [m]
    bodies: wp.uint64,  # Bvh over the boxes, grouped by world
    world: wp.array[int],  # (n_body,)
    lower: wp.array[wp.vec3],  # (n_body,) [m]
    upper: wp.array[wp.vec3],  # (n_body,) [m]
    # out
    n_near: wp.array[int],  # (n_body,)
    near: wp.array2d[int],  # (n_body, capacity), ascending
    # out, added to
    needed: wp.array[int],  # largest number seen, to grow the capacity
):
    """One thread per body: list the bodies of its world whose boxes meet its own."""
    m = wp.tid()
    capacity = near.shape[1]
    count = int(0)
    other = int(0)
    query = wp.bvh_query_aabb(bodies, lower[m], upper[m], wp.bvh_get_group_root(bodies, world[m]))
    while wp.bvh_query_next(query, other):
        if other != m and boxes_meet(lower[m], upper[m], lower[other], upper[other]):
            if count < capacity:
                k = int(count)
                while k > 0 and near[m, wp.max(k - 1, 0)] > other:
                    near[m, k] = near[m, k - 1]
                    k -= 1
                near[m, k] = other
            count += 1
    n_near[m] = wp.min(count, capacity)
    # What has exploded has no contacts, and no loop over its cells.
    if not wp.length(upper[m] - lower[m]) < HUGE * cell:
        n_near[m] = 0
    if count > capacity:
        wp.atomic_max(needed, 0, count)


@wp.kernel
def triangle_boxes(
    # in
    tris: wp.array[wp.vec3i],  # (n_tri,)
    tri_body: wp.array[int],  # (n_tri,)
    n_near: wp.array[int],  # (n_body,)
    body_edge: wp.array[float],  # (n_body,) [m]
    x0: wp.array[wp.vec3],  # (n_vert,) [m]
    x1: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    lower: wp.array[wp.vec3],  # (n_tri,) [m]
    upper: wp.array[wp.vec3],  # (n_tri,) [m]
):
    """One thread per triangle of a body that is near another: its box, grown by its own motion.

    An impulse may carry a vertex further than predicted.
    """
    t = wp.tid()
    body = tri_body[t]
    if n_near[body] == 0:
        return
    g = float(0.0)
    lo = x0[tris[t][0]]
    hi = lo
    for k in range(3):
        a = x0[tris[t][k]]
        b = x1[tris[t][k]]
        lo = wp.min(lo, wp.min(a, b))
        hi = wp.max(hi, wp.max(a, b))
        g = wp.max(g, wp.length(b - a))
    g += GROW * body_edge[body]
    lower[t] = lo - wp.vec3(g, g, g)
    upper[t] = hi + wp.vec3(g, g, g)


@wp.func
def has_triangle(surface: wp.uint64, body: int, lo: wp.vec3, hi: wp.vec3) -> bool:
    t = int(0)
    query = wp.bvh_query_aabb(surface, lo, hi, wp.bvh_get_group_root(surface, body))
    return wp.bvh_query_next(query, t)


@wp.kernel
def prune_near(
    # in
    surface: wp.uint64,  # Bvh over the triangles, grouped by body
    tris: wp.array[wp.vec3i],  # (n_tri,)
    lower: wp.array[wp.vec3],  # (n_body,) [m]
    upper: wp.array[wp.vec3],  # (n_body,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    n_near: wp.array[int],  # (n_body,)
    near: wp.array2d[int],  # (n_body, capacity)
):
    """One thread per body: keep the near bodies that may touch it; both sides decide alike."""
    m = wp.tid()
    count = int(0)
    for k in range(n_near[m]):
        other = near[m, k]
        lo = wp.max(lower[m], lower[other])
        hi = wp.min(upper[m], upper[other])
        own_there = has_triangle(surface, m, lo, hi)
        other_there = has_triangle(surface, other, lo, hi)
        keep = own_there and other_there
        middle = 0.5 * (lo + hi)
        if own_there and not other_there:
            keep = holds(surface, other, tris, x, middle)
        if other_there and not own_there:
            keep = holds(surface, m, tris, x, middle)
        if keep:
            near[m, count] = other
            count += 1
    n_near[m] = count
