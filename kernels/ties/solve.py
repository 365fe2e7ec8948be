"""Impulses that hold the ties: all those of a cluster at once.

    r = -C(x*) / h          x* where the velocities lead in the step                    [m/s]
    dp = K^-1 r,   v += G J^T dp,   p += dp                                             [N s]

A step ends where C is 0, or as far as a spring lets it; r then has the terms of tie.py. Rotations
make x* no linear function of v, so this is done twice (as in SHAKE: Ryckaert, Ciccotti and
Berendsen 1977). Within the sweeps of the contacts it is done after each sweep, on what the sweep
changed,

    r = -J (v - v_0)

Contacts so see the mobility of bodies that hang together, G - G J^T K^-1 J G. It is no larger than
G: their bounds hold. The closure does the same with positions.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import (
    Implicit,
    RigidMotion,
    acts,
    as_vec3,
    as_vec3d,
    deforms,
    moves,
)
from warp_contact.kernels.impulse.rows import Touched
from warp_contact.kernels.impulse.touched import velocity
from warp_contact.kernels.narrow_phase.contact_graph import ContactGraph
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.ties.matrix import block33, substitute
from warp_contact.kernels.ties.tie import HELD, Tied, Ties, across, change, direction, gap, speed
from warp_contact.kernels.worlds import DONE, Worlds

wp.set_module_options(OPTIONS)


@wp.kernel
def find_gaps(
    # in
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m] x*
    # in, out
    ties: Ties,
):
    """One thread per tie: what opens it in this step, r; 0 where nothing has changed since."""
    t = wp.tid()
    r = wp.vec3d()
    if ties.state[t] == HELD and ties.moved[ties.cluster[t]] != 0:
        c = across(gap(t, ties.now[t], ties.at[t], ties, x), direction(t, ties, x))
        h = wp.float64(dt[ties.vert[t][0]])
        r = -(c + ties.before[t]) / h - ties.soft[t] * ties.held[t]
        r = across(r, as_vec3d(ties.line[t]))
    ties.pull[t] = r


@wp.kernel
def find_speeds(
    # in
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # in, out
    ties: Ties,
):
    """One thread per tie: the velocity that opens it, r; a spring acts for the time dt too."""
    t = wp.tid()
    r = wp.vec3d()
    if ties.state[t] == HELD:
        r = -speed(t, ties, v) - ties.soft[t] * ties.held[t]
        if ties.compliance[t] > 0.0:
            c = gap(t, ties.now[t], ties.at[t], ties, x)
            c = across(c, as_vec3d(ties.line[t])) + ties.before[t]
            r -= c / wp.float64(dt[ties.vert[t][0]])
    ties.pull[t] = r


@wp.kernel
def find_changes(
    # in
    sweeps: bool,  # only in worlds that sweep
    worlds: Worlds,
    before: wp.array[wp.vec3],  # (n_vert,) velocities or positions
    y: wp.array[wp.vec3],  # (n_vert,)
    # in, out
    ties: Ties,
):
    """One thread per tie: how much it has opened since, r; its cluster has moved if any has."""
    t = wp.tid()
    r = wp.vec3d()
    done = sweeps and worlds.doing[worlds.of_vert[ties.vert[t][0]]] == DONE
    if ties.state[t] == HELD and not done:
        r = -change(t, ties, y, before) - ties.soft[t] * ties.since[t]
        if wp.dot(r, r) > wp.float64(0.0):
            ties.moved[ties.cluster[t]] = 1
    ties.pull[t] = r


@wp.func
def find_pulls(c: int, ties: Ties):
    """K^-1 r in place of r in the pulls of cluster c, as in matrix.py."""
    if ties.singular[c] != 0:
        for t in range(ties.first[c], ties.first[c + 1]):
            ties.asked[t] = ties.pull[t]
        substitute(c, ties)
        for t in range(ties.first[c], ties.first[c + 1]):
            ties.pull[t] = ties.asked[t] - wp.cw_mul(ties.added[t], ties.pull[t])
    substitute(c, ties)


@wp.kernel
def solve(
    # in
    keeps: bool,  # whether the impulses are those of the step
    # in, out
    ties: Ties,
):
    """One thread per cluster: what each tie adds, in place of r."""
    c = wp.tid()
    find_pulls(c, ties)
    for t in range(ties.first[c], ties.first[c + 1]):
        s = ties.pull[t]
        ties.since[t] = ties.since[t] + s
        if keeps:
            ties.held[t] = ties.held[t] + s


@wp.kernel
def settled(
    # in, out
    ties: Ties,
):
    """One thread per cluster: nothing has moved it since."""
    ties.moved[wp.tid()] = 0


@wp.kernel
def spread(
    # in
    ties: Ties,
    keeps: bool,  # whether the impulses are those of the step
    # in, out
    tied: Tied,
    # out, added to
    total: wp.array[wp.vec3],  # (n_vert,) [N s] of the step
):
    """One thread per vertex with ties: the sum of what they add."""
    k = wp.tid()
    sum = wp.vec3d()
    for e in range(tied.first[k], tied.first[k + 1]):
        t = tied.entry[e] // 8
        sum += wp.float64(ties.now[t][tied.entry[e] % 8]) * ties.pull[t]
    i = tied.vert[k]
    tied.p[i] = as_vec3(sum)
    if keeps:
        total[i] = total[i] + tied.p[i]


@wp.kernel
def follow(
    # in
    graph: ContactGraph,
    touched: Touched,
    tied: Tied,
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    z: wp.array[wp.vec3],  # (n_vert,) [kg y] of the contacts in this sweep
    busy: wp.array[int],  # (n_body,) 0 where there are none
    motion: RigidMotion,  # by them
    d: Implicit,
    # in, out
    y: wp.array[wp.vec3],  # (n_vert,) velocities or positions
):
    """One thread per vertex with ties and without contacts: how it answers those of its body."""
    i = tied.vert[wp.tid()]
    b = d.vert_body[i]
    if graph.start[i] < graph.start[i + 1] or busy[b] == 0 or d.inv_mass[i] == 0.0:
        return
    u = wp.vec3(0.0, 0.0, 0.0)
    if deforms(b, d):
        for k in range(touched.n[b]):
            j = touched.vert[d.body_vert[b] + k]
            u += block33(i, j, d) * z[j]
    if moves(b, d):
        y[i] = y[i] + velocity(i, u, z[i], x[i], motion, d)


@wp.kernel
def gather(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # in, out
    tied: Tied,
):
    """One thread per body: what its ties add in this sweep."""
    b = wp.tid()
    tied.busy[b] = 0
    pushed = wp.vec3d()
    turning = wp.vec3d()
    for k in range(tied.start[b], tied.start[b + 1]):
        i = tied.vert[k]
        p = tied.p[i]
        tied.z[i] = p
        if acts(p):
            tied.busy[b] = 1
        if moves(b, d):
            pushed += as_vec3d(p)
            turning += wp.cross(as_vec3d(x[i] - d.centre[b]), as_vec3d(p))
            tied.z[i] = wp.transpose(d.turn[i]) * p
    tied.motion.v[b] = d.inv_total[b] * as_vec3(pushed)
    tied.motion.w[b] = d.inv_inertia[b] * as_vec3(turning)


@wp.func
def answer(i: int, tied: Tied, x: wp.array[wp.vec3], d: Implicit) -> wp.vec3:
    """How vertex i answers the ties of its body."""
    b = d.vert_body[i]
    u = wp.vec3(0.0, 0.0, 0.0)
    own = wp.vec3(0.0, 0.0, 0.0)
    for k in range(tied.start[b], tied.start[b + 1]):
        j = tied.vert[k]
        if j == i:
            own = tied.z[j]
        if deforms(b, d):
            u += block33(i, j, d) * tied.z[j]
    return velocity(i, u, own, x[i], tied.motion, d)


@wp.kernel
def move(
    # in
    threads: int,
    worlds: Worlds,
    dt: wp.array[float],  # (n_vert,) [s]
    graph: ContactGraph,
    tied: Tied,
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # in, out
    y: wp.array[wp.vec3],  # (n_vert,) velocities or positions
    # out
    changed: wp.array[int],  # (n_vert,) this sweep where it changed y, else an older one
):
    """For each vertex with contacts, then those with ties alone: how it answers the ties."""
    n = graph.n_touched[0]
    for k in range(wp.tid(), n + tied.vert.shape[0], threads):
        i = int(0)
        if k < n:
            i = graph.touched[k]
        else:
            i = tied.vert[k - n]
            if graph.start[i] < graph.start[i + 1]:
                continue
        if tied.busy[d.vert_body[i]] == 0 or d.inv_mass[i] == 0.0:
            continue
        u = answer(i, tied, x, d)
        y[i] = y[i] + u
        if wp.length(u) * dt[i] > worlds.negligible[worlds.of_vert[i]]:
            changed[i] = worlds.sweep[0]
