"""Stage 2, broad phase: pairs that hold while nothing moves further than a skin (Verlet 1967).

Pairs are found half way of some step and kept for many steps. As long as no vertex is
further from there than the skin of its body, the pairs include all contacts. Each step tests them
exactly, so it finds the same contacts as with new pairs. New pairs are found once the predicted
position of a vertex is further away than ``free``. The rest of the skin is a reserve for what
impulses and the closure add within a step: they may turn the body back, and its neighbours may push
it. New pairs are also found when a body moves further than FASTER reserves in a step.

    free    = max((looks - 1/2) r, LEAST_SKIN e / 2) + (d - r) / 2   [m]
    reserve = max(d / 2, D - d / 2, LEAST_SKIN e / 2, free / 7)      [m]     skin = free + reserve

Skins are around the middle of the way that the step is predicted to go: its ends are d / 2 away.

d is the largest predicted motion of the body in a step, D that of the bodies near it, e the
shortest edge of its world. r is the motion that is left of d where contacts take the rest, as at
rest: the larger one of the last motions under impulses and of the mean motion since pairs were last
found.
``looks`` is the number of steps that the pairs should last. It is the same for all
bodies, and such that looks r is MEAN_SKIN edges on average. A few fast
bodies then do not use up the pairs of a pile at rest, and skins stay narrow where all bodies are
fast. A vibrating body stays near its place, so its pairs last longer. A body with nothing near it,
even with LONGEST for all, gets LONGEST.

Most pairs are not close to touching. A pair that is some distance apart is left alone until its two
bodies together have travelled that distance. A body travels the sum of its largest motions from one
detection pass to the next.
"""

import warp as wp

from warp_contact.kernels.broad_phase.near import MANY, Near
from warp_contact.kernels.geometry import boxes_meet
from warp_contact.kernels.lengths import LEAST_SKIN, MEAN_SKIN
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

SHORTEST = wp.constant(1.0)  # steps
LONGEST = wp.constant(32.0)  # steps
MOTION_UNIT = wp.constant(1.0e4)  # counts of an edge: a sum of integers has no order
FASTER = wp.constant(3.0)  # reserves in a step: the body was slower when its pairs were found
PART = wp.constant(1.0 / 7.0)  # of what is free: an eighth of the skin, as SURE of edges assumes
ROUNDING = wp.constant(1.01)  # of what is free: a body that moves as predicted stays within it
CAREFUL = wp.constant(0.99)  # part of a distance that is safe from rounding
FADING = wp.constant(0.8)  # of a recorded motion from one detection pass to the next
CHUNK = wp.constant(64)  # vertices reduced by one thread before it touches the maximum


@wp.kernel
def moved(
    # in
    vert_body: wp.array[int],  # (n_vert,)
    free: wp.array[float],  # (n_body,) [m]
    skin: wp.array[float],  # (n_body,) [m]
    built: wp.array[wp.vec3],  # (n_vert,) [m] half way of the step in which pairs were found
    x0: wp.array[wp.vec3],  # (n_vert,) [m]
    x1: wp.array[wp.vec3],  # (n_vert,) [m]
    # out, added to
    stale: wp.array[int],  # (1,) 1 when the pairs have to be found again
    age: wp.array[int],  # (1,) steps since they were found
):
    """One thread per vertex: whether it is beyond ``free``, or too fast for the reserve."""
    i = wp.tid()
    if i == 0:
        age[0] = age[0] + 1
    d = wp.max(wp.length_sq(x0[i] - built[i]), wp.length_sq(x1[i] - built[i]))
    most = free[vert_body[i]]
    fast = FASTER * (skin[vert_body[i]] - most)
    if not (d <= most * most and wp.length_sq(x1[i] - x0[i]) <= fast * fast):
        stale[0] = 1


@wp.kernel
def between(
    # in
    x0: wp.array[wp.vec3],  # (n_vert,) [m]
    x1: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    x: wp.array[wp.vec3],  # (n_vert,) [m]
):
    """One thread per vertex: half way."""
    i = wp.tid()
    x[i] = x0[i] + 0.5 * (x1[i] - x0[i])


@wp.kernel
def find_motion(
    # in
    vert_body: wp.array[int],  # (n_vert,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    last: wp.array[wp.vec3],  # (n_vert,) [m] positions of the last detection pass
    # out, added to
    motion: wp.array[float],  # (n_body,) [m] largest motion since then
):
    """One thread per CHUNK of vertices: the largest motions of their bodies."""
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
    edge: wp.array[float],  # (n_body,) shortest of the world [m]
    motion: wp.array[float],  # (n_body,) [m] predicted
    recent: wp.array[float],  # (n_body,) [m] largest of the last motions
    drift: wp.array[float],  # (n_body,) [m] since the pairs were found
    age: wp.array[int],  # (1,) steps since then
    # out
    rate: wp.array[float],  # (n_body,) [m] motion in a step
    # out, added to
    fastest: wp.array[float],  # (1,) [m]
    total: wp.array[int],  # (1,) sum of the rates, none above an edge, in edges / MOTION_UNIT
):
    """One thread per body: its rate; the motion of the fastest, and the sum of all rates."""
    m = wp.tid()
    mean = drift[m] / float(wp.max(age[0], 1))
    rate[m] = wp.min(motion[m], wp.max(recent[m], mean))
    wp.atomic_max(fastest, 0, motion[m])
    wp.atomic_add(total, 0, int(MOTION_UNIT * wp.min(rate[m] / edge[m], 1.0)))


@wp.func
def looks_at(total: int, n_body: int) -> float:
    """Steps that the pairs should last."""
    mean = float(total) / (MOTION_UNIT * float(n_body))
    return wp.clamp(MEAN_SKIN / wp.max(mean, 1.0e-6), SHORTEST, LONGEST)


@wp.func
def of_motion(motion: float, edge: float, times: float) -> float:
    return wp.max(times * motion, 0.5 * LEAST_SKIN * edge)


@wp.kernel
def widest_skins(
    # in
    edge: wp.array[float],  # (n_body,) shortest of the world [m]
    fastest: wp.array[float],  # (1,) [m]
    motion: wp.array[float],  # (n_body,) [m] predicted
    rate: wp.array[float],  # (n_body,) [m]
    # out
    skin: wp.array[float],  # (n_body,) [m]
):
    """One thread per body: the widest skin that it may get."""
    m = wp.tid()
    own = of_motion(rate[m], edge[m], LONGEST) + of_motion(motion[m], edge[m], 1.0)
    skin[m] = own + motion[m] - rate[m] + fastest[0]


@wp.func
def spare(m: int, looks: float, edge: float, rate: wp.array[float]) -> wp.vec3:
    """By how much a skin for so many steps is narrower than the widest one [m]."""
    d = of_motion(rate[m], edge, LONGEST) - of_motion(rate[m], edge, looks)
    return wp.vec3(d, d, d)


@wp.func
def meet_within(
    m: int, other: int, looks: float, edge: wp.array[float], rate: wp.array[float], of: Near
) -> bool:
    """Whether the boxes of two bodies meet with skins for so many steps."""
    a = spare(m, looks, edge[m], rate)
    b = spare(other, looks, edge[other], rate)
    return boxes_meet(of.lower[m] + a, of.upper[m] - a, of.lower[other] + b, of.upper[other] - b)


@wp.kernel
def choose_skins(
    # in
    edge: wp.array[float],  # (n_body,) shortest of the world [m]
    total: wp.array[int],  # (1,) sum of the rates
    motion: wp.array[float],  # (n_body,) [m] predicted
    rate: wp.array[float],  # (n_body,) [m]
    of: Near,  # with the widest skins
    # out
    free: wp.array[float],  # (n_body,) [m]
    skin: wp.array[float],  # (n_body,) [m]
    stale: wp.array[int],  # (1,) 0
    any_pair: wp.array[int],  # (1,) 0
    age: wp.array[int],  # (1,) 0
):
    """One thread per body: its skin, and the part of it that is free."""
    m = wp.tid()
    looks = looks_at(total[0], motion.shape[0])
    push = float(0.0)
    other = int(0)
    if of.n_near[m] <= MANY:
        for k in range(of.n_near[m]):
            other = of.other[m, k]
            if meet_within(m, other, looks, edge, rate, of):
                push = wp.max(push, motion[other])
    else:
        root = wp.bvh_get_group_root(of.bodies, of.world[m])
        query = wp.bvh_query_aabb(of.bodies, of.lower[m], of.upper[m], root)
        while wp.bvh_query_next(query, other):
            if other != m and meet_within(m, other, looks, edge, rate, of):
                push = wp.max(push, motion[other])
    if of.n_near[m] == 0:
        looks = LONGEST
    later = wp.max((looks - 0.5) * rate[m], 0.5 * LEAST_SKIN * edge[m])
    free[m] = ROUNDING * (later + 0.5 * (motion[m] - rate[m]))
    reserve = wp.max(of_motion(motion[m], edge[m], 0.5), push - 0.5 * motion[m])
    skin[m] = free[m] + wp.max(reserve, PART * free[m])
    stale[0] = 0
    any_pair[0] = 0
    age[0] = 0


@wp.kernel
def add_motion(
    # in, out
    motion: wp.array[float],  # (n_body,) [m] 0 on return
    recent: wp.array[float],  # (n_body,) [m] largest of the last motions, older ones count less
    travelled: wp.array[float],  # (n_body + n_plane,) [m]
    # out
    found: wp.array[int],  # (1 + n_world,) 0: new contacts of edges are counted from here on
):
    """One thread per body: add its motion to the distance that it has travelled."""
    m = wp.tid()
    if m == 0:
        found[0] = 0
    if m + 1 < found.shape[0]:  # there are no more worlds than bodies
        found[m + 1] = 0
    travelled[m] = travelled[m] + motion[m]
    recent[m] = wp.max(motion[m], FADING * recent[m])
    motion[m] = 0.0
