"""What may touch while nothing moves further than a skin: found once, kept for many steps.

Candidates are found at the positions of some step. As long as no vertex is further than the skin of
its body from there, all that touches is among them, and the steps test them exactly: the same
contacts come out as without (Verlet 1967). They are found again once the prediction of some vertex
is as far away as is free; the rest of the skin is reserved for what impulses and the closure add
within a step: they may stop the body, and what is near may push it on. A body that has become
FASTER than that is looked at anew too.

    free    = max(looks d, LEAST e / 2) + D / 2     [m]
    reserve = max(d, LEAST e / 2) + D / 2           [m]     skin = free + reserve

d is the largest motion of the body in a step, D that of the bodies near it, e the shortest edge.
The number of looks is the same for all bodies, and such that looks d is MEAN edges on average: some
fast bodies do not wear out the candidates of a pile at rest, and where all are fast the lists stay
short. What swings does not go far: candidates last several times as long. A body that has nothing
near, even if all had the LONGEST, gets it.

Most candidates are not close to touching. A pair that is found apart by some distance sleeps until
both bodies have come that way together; ``way`` adds up the largest motion of a body in each look.
"""

import warp as wp

from warp_contact.kernels.broad_phase.near import MANY, Near
from warp_contact.kernels.geometry import boxes_meet
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

LEAST = wp.constant(0.02)  # of the shortest edge, with friction and closure at rest in mind
MEAN = wp.constant(0.08)  # of the shortest edge: longer lists cost more than they save
SHORTEST = wp.constant(1.0)  # looks
LONGEST = wp.constant(32.0)  # looks
UNIT = wp.constant(1.0e4)  # counts of an edge, for a sum that does not depend on its order
FASTER = wp.constant(2.0)  # reserves in a step: what was slow when it was found
CAREFUL = wp.constant(0.99)  # part of a distance that rounding leaves
FADING = wp.constant(0.8)  # of a motion from look to look
CHUNK = wp.constant(64)  # vertices reduced by one thread before it touches the maximum


@wp.kernel
def moved(
    # in
    vert_body: wp.array[int],  # (n_vert,)
    free: wp.array[float],  # (n_body,) [m]
    skin: wp.array[float],  # (n_body,) [m]
    built: wp.array[wp.vec3],  # (n_vert,) [m] positions of the candidates
    x0: wp.array[wp.vec3],  # (n_vert,) [m]
    x1: wp.array[wp.vec3],  # (n_vert,) [m]
    # out, added to
    stale: wp.array[int],  # (1,) 1 when the candidates have to be found again
):
    """One thread per vertex: whether it is further than is free, or too fast for the reserve."""
    i = wp.tid()
    d = wp.max(wp.length_sq(x0[i] - built[i]), wp.length_sq(x1[i] - built[i]))
    most = free[vert_body[i]]
    fast = FASTER * (skin[vert_body[i]] - most)
    if not (d <= most * most and wp.length_sq(x1[i] - x0[i]) <= fast * fast):
        stale[0] = 1


@wp.kernel
def track(
    # in
    vert_body: wp.array[int],  # (n_vert,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    last: wp.array[wp.vec3],  # (n_vert,) [m] positions of the last look
    # out, added to
    motion: wp.array[float],  # (n_body,) [m] largest motion since then
):
    """One thread per CHUNK of vertices."""
    first = wp.tid() * CHUNK
    body = vert_body[first]
    largest = float(0.0)
    for i in range(first, wp.min(first + CHUNK, x.shape[0])):
        if vert_body[i] != body:
            wp.atomic_max(motion, body, largest)
            body = vert_body[i]
            largest = 0.0
        largest = wp.max(largest, wp.length(x[i] - last[i]))
        last[i] = x[i]
    wp.atomic_max(motion, body, largest)


@wp.kernel
def find_fastest(
    # in
    edge: float,  # shortest mean edge of a body [m]
    motion: wp.array[float],  # (n_body,) [m]
    # out, added to
    fastest: wp.array[float],  # (1,) [m]
    total: wp.array[int],  # (1,) sum of the motions, none above an edge, in edges / UNIT
):
    """One thread per body."""
    m = wp.tid()
    wp.atomic_max(fastest, 0, motion[m])
    wp.atomic_add(total, 0, int(UNIT * wp.min(motion[m] / edge, 1.0)))


@wp.func
def looks_at(total: int, n_body: int) -> float:
    """Looks that candidates last."""
    mean = float(total) / (UNIT * float(n_body))
    return wp.clamp(MEAN / wp.max(mean, 1.0e-6), SHORTEST, LONGEST)


@wp.func
def of_motion(motion: float, edge: float, times: float) -> float:
    return wp.max(times * motion, 0.5 * LEAST * edge)


@wp.kernel
def widest_skins(
    # in
    edge: float,  # shortest mean edge of a body [m]
    fastest: wp.array[float],  # (1,) [m]
    motion: wp.array[float],  # (n_body,) [m]
    # out
    skin: wp.array[float],  # (n_body,) [m]
):
    """One thread per body: the longest that it may get."""
    m = wp.tid()
    own = of_motion(motion[m], edge, LONGEST) + of_motion(motion[m], edge, 1.0)
    skin[m] = own + fastest[0]


@wp.func
def spare(m: int, looks: float, edge: float, motion: wp.array[float]) -> wp.vec3:
    """By how much a skin for so many looks is less wide than the widest."""
    d = of_motion(motion[m], edge, LONGEST) - of_motion(motion[m], edge, looks)
    return wp.vec3(d, d, d)


@wp.func
def meet_within(
    m: int, other: int, looks: float, edge: float, motion: wp.array[float], of: Near
) -> bool:
    """Whether the boxes of two bodies meet with skins for so many looks."""
    a = spare(m, looks, edge, motion)
    b = spare(other, looks, edge, motion)
    return boxes_meet(of.lower[m] + a, of.upper[m] - a, of.lower[other] + b, of.upper[other] - b)


@wp.kernel
def choose_skins(
    # in
    edge: float,  # shortest mean edge of a body [m]
    total: wp.array[int],  # (1,) sum of the motions
    motion: wp.array[float],  # (n_body,) [m]
    of: Near,  # with the widest skins
    # out
    free: wp.array[float],  # (n_body,) [m]
    skin: wp.array[float],  # (n_body,) [m]
    stale: wp.array[int],  # (1,) 0
    some: wp.array[int],  # (1,) 0
):
    """One thread per body."""
    m = wp.tid()
    looks = looks_at(total[0], motion.shape[0])
    push = float(0.0)
    other = int(0)
    if of.n_near[m] <= MANY:
        for k in range(of.n_near[m]):
            other = of.near[m, k]
            if meet_within(m, other, looks, edge, motion, of):
                push = wp.max(push, motion[other])
    else:
        root = wp.bvh_get_group_root(of.bodies, of.world[m])
        query = wp.bvh_query_aabb(of.bodies, of.lower[m], of.upper[m], root)
        while wp.bvh_query_next(query, other):
            if other != m and meet_within(m, other, looks, edge, motion, of):
                push = wp.max(push, motion[other])
    if of.n_near[m] == 0:
        looks = LONGEST
    free[m] = of_motion(motion[m], edge, looks) + 0.5 * push
    skin[m] = free[m] + of_motion(motion[m], edge, 1.0) + 0.5 * push
    stale[0] = 0
    some[0] = 0


@wp.kernel
def go_on(
    # in, out
    motion: wp.array[float],  # (n_body,) [m] 0 on return
    pace: wp.array[float],  # (n_body,) [m] largest of the last motions, older ones count less
    way: wp.array[float],  # (n_body + n_plane,) [m]
    # out
    n_new: wp.array[int],  # (1,) 0: a look at the edges begins to count
):
    """One thread per body."""
    m = wp.tid()
    if m == 0:
        n_new[0] = 0
    way[m] = way[m] + motion[m]
    pace[m] = wp.max(motion[m], FADING * pace[m])
    motion[m] = 0.0
