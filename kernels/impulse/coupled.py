"""Stage 5, impulses, where some bodies take implicit steps: all contacts at once, by row sums.

The sweeps are those of impulse.py, with the bounds of rows.py. A contact that begins to approach
waits for a sweep, until the row sums count it.

Within the sweeps only touched vertices move, then the sum of all impulses moves all (touched.py).
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import LUMPED, Implicit
from warp_contact.kernels.impulse.constraint import Constraint, Impulse, least_closing
from warp_contact.kernels.impulse.impulse import (
    Limits,
    ahead_of,
    clear_parts,
    is_quiet,
    projected,
    set_parts,
    surface_velocity,
)
from warp_contact.kernels.impulse.rows import RECOUNT, row_weight
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.narrow_phase.contact_graph import ContactGraph, total
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import DONE, LAST, Worlds, ask

wp.set_module_options(OPTIONS)

USUAL = wp.constant(240.0)  # steps [1/s]: shorter ones allow as much velocity, not as much way


@wp.kernel
def find_counted(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    impulse: wp.array[Impulse],  # (capacity,)
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    counted: wp.array[int],  # (capacity,) 1 where the contact pushes or approaches
):
    """For each contact: whether it counts when the sweeps begin."""
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        excess = wp.dot(surface_velocity(at, constraint[c], v), at.normal)
        excess += least_closing(constraint[c])
        counted[c] = int(0)
        if impulse[c].ahead[3] > 0.0 or excess < 0.0:
            counted[c] = 1


@wp.kernel
def solve_contacts(
    # in
    threads: int,
    limits: Limits,
    dt: wp.array[float],  # (n_vert,) [s]
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    row: wp.array[float],  # (n_vert,) [1/kg]
    changed: wp.array[int],  # (n_vert,) last sweep if it changed the velocity
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # in, out
    impulse: wp.array[Impulse],  # (capacity,) accumulated in this step; v includes ``ahead``
    busy: wp.array[int],  # (capacity,) 2 if this sweep changed the impulses, 1 negligibly, 0 not
    counted: wp.array[int],  # (capacity,)
    # out
    part: wp.array[wp.vec3],  # (5 capacity,) [N s] what this sweep adds at each vertex
    served: wp.array[int],  # (n_vert,) this sweep where it adds something
    # out, added to
    worlds: Worlds,  # those that need another sweep
):
    """For each contact of a world that sweeps: update its accumulated impulses."""
    sweep = worlds.sweep[0]
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        world = worlds.of_vert[at.vert[0]]
        if worlds.doing[world] == DONE:
            continue
        last = worlds.doing[world] == LAST  # do not extrapolate the impulses after it
        to = constraint[c]
        idle = not (last or sweep == 1) and busy[c] < 2 and is_quiet(at, changed, sweep)
        if to.inv_mass == 0.0 or (idle and counted[c] < 2):
            if busy[c] > 0 or sweep == 1:
                busy[c] = 0
                clear_parts(c, part)
            continue
        n = at.normal
        u = surface_velocity(at, to, v)
        un = wp.dot(u, n)
        excess = un + least_closing(to)
        before = impulse[c]
        w = row_weight(at, row) * (to.inv_mass_turning / to.inv_mass)
        h = dt[at.vert[0]]
        approach = limits.tolerance * wp.min(USUAL * h, 1.0) * at.edge_length
        pushes = before.ahead[3] > 0.0 or excess < 0.0
        if counted[c] == 0:
            busy[c] = 0
            clear_parts(c, part)
            if pushes and not last:
                counted[c] = 2  # the row sums will count it in the next sweep
                ask(worlds, world, limits.sweeps, -excess * h > approach)
                for k in range(5):
                    served[at.vert[k]] = sweep
            continue
        counted[c] = 1
        if not pushes and sweep % RECOUNT == 0:
            counted[c] = 0
        new = projected(before, u, un, excess, n, to, w)
        y = before.ahead
        rubbed = wp.length(new.friction - wp.vec3(y[0], y[1], y[2]))
        off = wp.max(wp.abs(new.normal - y[3]), rubbed) * w
        if off * h > approach:
            ask(worlds, world, limits.sweeps, True)
        beta = float(0.0)
        if not last:
            beta = limits.extrapolation * float(sweep - 1) / float(sweep + 2)
        new.ahead = ahead_of(new, before, beta)
        change = set_parts(c, at, to, before.ahead, new.ahead, sweep, part, served)
        negligible = worlds.negligible[world]
        busy[c] = wp.where(wp.length(change) * w * h > negligible, 2, 1)
        impulse[c] = new


@wp.kernel
def collect(
    # in
    threads: int,
    graph: ContactGraph,
    part: wp.array[wp.vec3],  # (5 capacity,) [kg y]
    worlds: Worlds,
    moving: wp.array[int],  # (n_world,) not 0 where there is something to add; empty if in all
    # out
    p: wp.array[wp.vec3],  # (n_vert,) [kg y]; the host clears it first
):
    """For each vertex with contacts, in worlds that move: the sum of their parts."""
    for k in range(wp.tid(), graph.n_touched[0], threads):
        i = graph.touched[k]
        if moving.shape[0] > 0:
            if moving[worlds.of_vert[i]] == 0:
                continue
        p[i] = total(i, graph, part)


@wp.kernel
def record(
    # in
    threads: int,
    graph: ContactGraph,
    p: wp.array[wp.vec3],  # (n_vert,) [N s]
    # out, added to
    received: wp.array[wp.vec3],  # (n_vert,) [N s] since the frame began
):
    """For each vertex with contacts: its impulse is one of the frame."""
    for k in range(wp.tid(), graph.n_touched[0], threads):
        i = graph.touched[k]
        received[i] = received[i] + p[i]


@wp.kernel
def add(
    # in
    before: wp.array[wp.vec3],  # (n_vert,) y before the sweeps
    p: wp.array[wp.vec3],  # (n_vert,) [kg y]
    answer: wp.array[wp.vec3],  # (n_vert,) of bodies that take implicit steps
    d: Implicit,
    # out
    y: wp.array[wp.vec3],  # (n_vert,) velocities or positions
):
    """One thread per vertex: add what the impulses change."""
    i = wp.tid()
    if d.inv_mass[i] == 0.0:
        y[i] = before[i]
    elif d.kind[d.vert_body[i]] == LUMPED:
        y[i] = before[i] + d.inv_mass[i] * p[i]
    else:
        y[i] = before[i] + answer[i]
