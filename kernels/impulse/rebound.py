"""Restitution: what strikes in a step (strike.py) flies apart at its end.

In the step of an impact the usual impulses stop the sides where they meet. Then they part: normal
impulses alone, with the contacts at the new positions, lead to the nearest velocities at which the
sides of contacts that strike part as fast as they shall, and no other contact closes (Moreau 1988).
Friction acts while the sides are stopped, up to (1 + e) mu lambda for both.

What parts so gets back no more energy than e^2 of what stopping it took, with any number of
contacts and coefficients: to stop it the nearest velocities without approach would have been
enough. Bodies that turn are stopped at other positions than those where they part. Therefore it is
also made sure: where the contacts of a body give back more (Stronge 1990), they part as much
slower.
"""

import warp as wp

from warp_contact.kernels.geometry import lines_closest, projected_weights
from warp_contact.kernels.implicit.bodies import Implicit
from warp_contact.kernels.impulse.constraint import Constraint, Impulse
from warp_contact.kernels.impulse.strike import OPEN, Strike, energy_taken, restitution_of
from warp_contact.kernels.lengths import VERTEX_MARGIN
from warp_contact.kernels.narrow_phase.contact import (
    Contact,
    is_of_edge,
    meets_edge,
    relative_velocity,
)
from warp_contact.kernels.narrow_phase.edge_contact import EdgeContact
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

COUNTS = wp.constant(wp.float64(2.0**50))  # energy of the mass of a body at an edge in a step
SLIP = wp.constant(1.0)  # change of the weights in a step, above which they stay


@wp.func
def at_end(c: Contact, x: wp.array[wp.vec3]) -> Contact:
    """A contact whose sides are opposite each other at x: its impulse keeps angular momentum."""
    if c.on_plane:
        return c
    p = x[c.vert[0]]
    q = x[c.vert[1]]
    a = x[c.vert[2]]
    b = x[c.vert[3]]
    own = wp.vec2(c.coef[0], c.coef[1])
    if meets_edge(c):
        su = lines_closest(p, q, a, b)
        n = wp.normalize(wp.cross(q - p, b - a))
        if wp.abs(su[0] - own[1]) < SLIP and wp.abs(su[1] + c.coef[3]) < SLIP:
            c.normal = wp.where(wp.dot(n, c.normal) < 0.0, -n, n)
            c.coef[0] = 1.0 - su[0]
            c.coef[1] = su[0]
            c.coef[2] = su[1] - 1.0
            c.coef[3] = -su[1]
        return c
    if is_of_edge(c):
        p = own[0] * p + own[1] * q
    w = projected_weights(p, c.normal, a, b, x[c.vert[4]])
    if wp.length(w + wp.vec3(c.coef[2], c.coef[3], c.coef[4])) < SLIP:
        for k in range(3):
            c.coef[2 + k] = -w[k]
    return c


@wp.kernel
def follow(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    x: wp.array[wp.vec3],  # (n_vert,) [m] at the end of the step
    # out
    now: wp.array[Contact],  # (capacity,)
):
    """For each contact: itself at x."""
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        if wp.length_sq(at.normal) > 0.0:
            at = at_end(at, x)
        now[c] = at


@wp.func
def is_open(c: Contact, to: Constraint, dt: wp.array[float]) -> bool:
    """Whether the sides do not touch yet."""
    return to.gap_bound * dt[c.vert[0]] > VERTEX_MARGIN * c.edge_length


@wp.kernel
def stop(
    # in
    threads: int,
    restitution: wp.array[float],  # (n_body + n_plane,)
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    dt: wp.array[float],  # (n_vert,) [s]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # in, out
    constraint: wp.array[Constraint],  # (capacity,)
    strike: wp.array[Strike],  # (capacity,)
):
    """For each contact that strikes: friction for both parts, before it is stopped to the end.

    What is open yet is left to the next step.
    """
    for c in range(wp.tid(), n_contact[0], threads):
        if strike[c].speed > 0.0:
            e = restitution_of(contact[c].pair, restitution)
            constraint[c].friction = (1.0 + e) * constraint[c].friction
            constraint[c].gap_bound = 0.0  # what rounding and turning left of the gap
            strike[c].u = relative_velocity(contact[c], v) + strike[c].kick
        elif strike[c].speed == OPEN or is_open(contact[c], constraint[c], dt):
            constraint[c].inv_mass = 0.0


@wp.func
def add_energy(
    e: float, h: float, pair: wp.vec2i, edge: wp.array[float], d: Implicit, to: wp.array[wp.int64]
):
    """Add an energy [J] to both bodies of a pair; as integers, their sum has no order."""
    for k in range(2):
        b = pair[k]
        if b < d.inv_total.shape[0]:
            way = wp.float64(h) / wp.float64(edge[b])
            share = wp.float64(e) * wp.float64(d.inv_total[b]) * way * way
            wp.atomic_add(to, b, wp.int64(wp.round(share * COUNTS)))


@wp.kernel
def part(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    edge: wp.array[float],  # (n_body,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    d: Implicit,
    # in, out
    constraint: wp.array[Constraint],  # (capacity,)
    impulse: wp.array[Impulse],  # (capacity,) 0 from now on
    strike: wp.array[Strike],  # (capacity,)
    # out, added to
    most: wp.array[wp.int64],  # (n_body,) e^2 E of each body, in counts
):
    """For each contact: it is stopped, and parts without friction."""
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        to = constraint[c]
        to.friction = 0.0
        to.ramp = wp.vec3(0.0, 0.0, 0.0)
        s = strike[c]
        if s.speed > 0.0:
            u = relative_velocity(at, v) + s.kick
            s.taken += energy_taken(s.u, u, impulse[c], at.normal)
            s.u = u
            strike[c] = s
            add_energy(s.back * s.taken, s.h, at.pair, edge, d, most)
            to.parting = s.speed
        constraint[c] = to
        impulse[c] = Impulse()


@wp.kernel
def add_given(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    edge: wp.array[float],  # (n_body,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    d: Implicit,
    impulse: wp.array[Impulse],  # (capacity,)
    strike: wp.array[Strike],  # (capacity,)
    # out, added to
    given: wp.array[wp.int64],  # (n_body,) what each body got back, in counts
):
    """For each contact that strikes: the energy that it gave back."""
    for c in range(wp.tid(), n_contact[0], threads):
        s = strike[c]
        if s.speed > 0.0:
            u = relative_velocity(contact[c], v) + s.kick
            e = -energy_taken(s.u, u, impulse[c], contact[c].normal)
            add_energy(e, s.h, contact[c].pair, edge, d, given)


@wp.kernel
def temper(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    strike: wp.array[Strike],  # (capacity,)
    most: wp.array[wp.int64],  # (n_body,)
    given: wp.array[wp.int64],  # (n_body,)
    # in, out
    constraint: wp.array[Constraint],  # (capacity,)
):
    """For each contact that strikes: it parts as much slower as a body of it got too much."""
    for c in range(wp.tid(), n_contact[0], threads):
        if strike[c].speed > 0.0:
            part = wp.float64(1.0)
            for k in range(2):
                b = contact[c].pair[k]
                if b < given.shape[0]:
                    if given[b] > wp.max(most[b], wp.int64(0)):
                        least = wp.float64(wp.max(most[b], wp.int64(0))) / wp.float64(given[b])
                        part = wp.min(part, least)
            constraint[c].parting = wp.float32(wp.sqrt(part)) * constraint[c].parting


@wp.kernel
def forget(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    n_vertex: wp.array[int],  # (1,) contacts of vertices
    contact: wp.array[Contact],  # (capacity,)
    strike: wp.array[Strike],  # (capacity,)
    # out
    partner: wp.array[int],  # (n_vert,) of the warm start, -1 where it strikes
    edges: wp.array[EdgeContact],  # (capacity,) of the warm start, without impulse where it strikes
):
    """For each contact that strikes: the next step does not expect its impulse again."""
    for c in range(wp.tid(), n_contact[0], threads):
        if strike[c].speed > 0.0:
            if c < n_vertex[0]:
                partner[contact[c].vert[0]] = -1
            else:
                edges[c - n_vertex[0]].kept = wp.vec4(0.0, 0.0, 0.0, 0.0)


@wp.kernel
def add_to_step(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    impulse: wp.array[Impulse],  # (capacity,)
    # in, out
    of_step: wp.array[Impulse],  # (capacity,)
):
    """For each contact: its impulse is one of the step."""
    for c in range(wp.tid(), n_contact[0], threads):
        of_step[c].normal = of_step[c].normal + impulse[c].normal
        of_step[c].friction = of_step[c].friction + impulse[c].friction
