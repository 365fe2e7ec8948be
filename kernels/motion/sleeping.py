"""Sleeping: which bodies are at rest, and which islands of them need no steps for now.

A body is at rest as long as its vertices stay within STILL of where its rest began, and none is
faster than FAST. Lower speeds tell little, because resting contacts rattle in their gaps. An island
is a set of bodies connected by boxes that meet. The boxes are grown by the distance that the
fastest body travels in a frame. An island sleeps when all its bodies have been at rest for some
frames. So no moving body, nor one that it pushes, can reach a sleeping body before the next frame.
A body with all vertices fixed supports others, but does not connect them to an island.
"""

import warp as wp

from warp_contact.kernels.geometry import boxes_meet
from warp_contact.kernels.lengths import FAST, ISLAND_GAP, STILL
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.kernel
def watch(
    # in
    time: float,  # of a frame [s]
    vert_body: wp.array[int],  # (n_vert,)
    world: wp.array[int],  # (n_body,) its number, -1 for a body that may not sleep
    body_edge: wp.array[float],  # (n_body,) [m]
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    anchor: wp.array[wp.vec3],  # (n_vert,) [m] where the rest of its body began
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out, added to
    moved: wp.array[int],  # (n_body,) 1 when a vertex moved
    speed: wp.array[float],  # (n_world,) [m/s] of the fastest vertex
):
    """One thread per vertex: whether it moves. A fixed one with a velocity always does."""
    i = wp.tid()
    m = vert_body[i]
    if world[m] < 0:
        return
    u = wp.length(v[i])
    wp.atomic_max(speed, world[m], u)
    if inv_mass[i] == 0.0 and u > 0.0:
        moved[m] = 1
    near = wp.length(x[i] - anchor[i]) <= STILL * body_edge[m]  # False for NaN
    if not near or time * u > FAST * body_edge[m]:
        moved[m] = 1


@wp.kernel
def begin_rest(
    # in
    vert_body: wp.array[int],  # (n_vert,)
    moved: wp.array[int],  # (n_body,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    anchor: wp.array[wp.vec3],  # (n_vert,) [m]
):
    """One thread per vertex: where the next rest begins."""
    i = wp.tid()
    if moved[vert_body[i]] == 1:
        anchor[i] = x[i]


@wp.kernel
def count_rest(
    # in
    wanted: int,  # frames after which a body may sleep
    time: float,  # of a frame [s]
    gravity: float,  # [m/s^2]
    world: wp.array[int],  # (n_body,) its number, -1 for a body that may not sleep
    body_edge: wp.array[float],  # (n_body,) [m]
    moved: wp.array[int],  # (n_body,)
    speed: wp.array[float],  # (n_world,) [m/s]
    # in, out
    frames: wp.array[int],  # (n_body,) for which it has been at rest
    # out
    awake: wp.array[int],  # (n_body,) 1 until it has rested for long enough
    reach: wp.array[float],  # (n_body,) [m] what its box grows by
):
    """One thread per body: count its frames at rest."""
    m = wp.tid()
    if world[m] < 0:
        return
    frames[m] = wp.where(moved[m] == 1, 0, wp.min(frames[m] + 1, wanted))
    awake[m] = wp.where(frames[m] < wanted, 1, 0)
    reach[m] = ISLAND_GAP * body_edge[m] + time * (speed[world[m]] + time * gravity)


@wp.kernel
def wake_island(
    # in
    bodies: wp.uint64,  # Bvh over the boxes, grouped by world
    world: wp.array[int],  # (n_body,)
    lower: wp.array[wp.vec3],  # (n_body,) [m]
    upper: wp.array[wp.vec3],  # (n_body,) [m]
    mobile: wp.array[int],  # (n_body,) 1 where a vertex is not fixed
    # in, out
    awake: wp.array[int],  # (n_body,)
    # out, added to
    again: wp.array[int],  # (1,) 1 when another body woke up
):
    """One thread per body: wake it if its box meets that of one awake."""
    m = wp.tid()
    if awake[m] == 1 or mobile[m] == 0:
        return
    other = int(0)
    query = wp.bvh_query_aabb(bodies, lower[m], upper[m], wp.bvh_get_group_root(bodies, world[m]))
    while wp.bvh_query_next(query, other):
        if awake[other] == 1 and boxes_meet(lower[m], upper[m], lower[other], upper[other]):
            awake[m] = 1
            again[0] = 1


@wp.kernel
def pause_vertices(
    # in
    vert_body: wp.array[int],  # (n_vert,)
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    awake: wp.array[int],  # (n_body,)
    idle: wp.array[int],  # (n_body,) 1 in a world of which all bodies sleep
    # out
    pliant: wp.array[float],  # (n_vert,) [1/kg] inv_mass, 0 asleep
    v: wp.array[wp.vec3],  # (n_vert,) [m/s] 0 asleep
    impulse: wp.array[wp.vec3],  # (n_vert,) [N s] of the frame: unchanged asleep, else 0
):
    """One thread per vertex: stop it if asleep; a fixed one gets a new impulse in every frame.

    But not where nothing is awake that could exchange one with it.
    """
    i = wp.tid()
    pliant[i] = 0.0
    if awake[vert_body[i]] == 1:
        pliant[i] = inv_mass[i]
    else:
        v[i] = wp.vec3(0.0, 0.0, 0.0)
    if awake[vert_body[i]] == 1 or (inv_mass[i] == 0.0 and idle[vert_body[i]] == 0):
        impulse[i] = wp.vec3(0.0, 0.0, 0.0)


@wp.kernel
def clear_pairs(
    # in
    awake: wp.array[int],  # (n_body,)
    # in, out
    key: wp.array[wp.int64],  # (n_pair,) of pair_impulses.py
    total: wp.array2d[wp.int64],  # (n_pair, COLUMNS) of pair_impulses.py
):
    """One thread per slot: forget pairs with a body awake; the others keep their last force."""
    k = wp.tid()
    if key[k] < wp.int64(0):
        return
    lo = int(key[k] >> wp.int64(32))
    hi = int(key[k] & wp.int64(0xFFFFFFFF))
    stays = awake[lo] == 0
    if hi < awake.shape[0] and awake[wp.min(hi, awake.shape[0] - 1)] == 1:
        stays = False
    if not stays:
        key[k] = wp.int64(-1)
        for j in range(total.shape[1]):
            total[k, j] = wp.int64(0)
