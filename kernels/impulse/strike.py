"""Restitution: which contacts strike in a step, and how fast their sides shall part.

    s_0 = -(u(v_0) + u(v*)) . n / 2              closing speed when the step begins         [m/s]
    d = -(u(v*) - u(v_0)) . n                    what forces add to it in the step          [m/s]
    s = sqrt(s_0^2 + 2 d max(0, c))              that where the surfaces meet               [m/s]
    u . n = e s + d / 2                          at the end of the step
    E = -sum (u + u') . p / 2                    taken by impulses p that led from u to u'  [J]

v_0 are the velocities at the start of the step, v* those without contact, half a step earlier and
later than the positions there; u and c, the closing speed that is left, are those of impulse.py. e
is the mean of the coefficients of both bodies (Newton's law). The sum under the root is the energy
of a free flight over the gap, and d / 2 is what velocities of half a step before the positions
lack: at the time of the positions u . n is e s, whatever the step. E is that at the same times.

A slow contact does not strike: one whose speed s is below REST times what gravity, or the forces at
the contact, add in a step. Else what rests would jump.
"""

import warp as wp

from warp_contact.kernels.impulse.constraint import Constraint, Impulse
from warp_contact.kernels.narrow_phase.contact import Contact, relative_velocity
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import FIRST_LOOK, Worlds

wp.set_module_options(OPTIONS)

REST = wp.constant(2.0)  # steps of gravity: what is no faster rests
OPEN = wp.constant(-1.0)  # for a speed: it may strike later


@wp.struct
class Strike:
    """What is known of a contact that strikes."""

    speed: float  # [m/s] e s + d / 2, 0 where it does not strike, or OPEN
    back: float  # [-] e^2, the part of E that comes back
    taken: float  # [J] E of the impulses that stopped it
    u: wp.vec3  # [m/s] before the impulses that come, at the time of the positions
    kick: wp.vec3  # [m/s] what forces add to u in half a step
    h: float  # [s] the step


@wp.func
def restitution_of(pair: wp.vec2i, restitution: wp.array[float]) -> float:
    """Coefficient between two bodies: the mean of theirs."""
    return 0.5 * (restitution[pair[0]] + restitution[pair[1]])


@wp.kernel
def find_strikes(
    # in
    threads: int,
    restitution: wp.array[float],  # (n_body + n_plane,)
    gravity: wp.array[wp.vec3],  # (1,) [m/s^2]
    dt: wp.array[float],  # (n_vert,) [s]
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    before: wp.array[wp.vec3],  # (n_vert,) [m/s] v_0
    free: wp.array[wp.vec3],  # (n_vert,) [m/s] v*
    # in, out
    constraint: wp.array[Constraint],  # (capacity,) with friction for both parts
    # out
    strike: wp.array[Strike],  # (capacity,)
):
    """For each contact: the speed at which its sides shall part, if they meet in this step."""
    for c in range(wp.tid(), n_contact[0], threads):
        strike[c] = Strike()
        at = contact[c]
        e = restitution_of(at.pair, restitution)
        h = dt[at.vert[0]]
        if e == 0.0 or h == 0.0 or constraint[c].inv_mass == 0.0:
            continue
        last = relative_velocity(at, free)
        kick = 0.5 * (last - relative_velocity(at, before))
        closing = -wp.dot(last - kick, at.normal)
        added = -2.0 * wp.dot(kick, at.normal)
        square = closing * closing + 2.0 * added * wp.max(constraint[c].gap_bound, 0.0)
        rest = REST * wp.max(h * wp.length(gravity[0]), wp.abs(added))
        if closing > 0.0 and square > rest * rest:
            to = Strike()
            to.speed = e * wp.sqrt(square) + 0.5 * added
            to.back = e * e
            to.u = last - kick
            to.kick = kick
            to.h = h
            strike[c] = to
            constraint[c].friction = (1.0 + e) * constraint[c].friction


@wp.func
def energy_taken(before: wp.vec3, after: wp.vec3, p: Impulse, n: wp.vec3) -> float:
    """E that an impulse took [J]."""
    return -0.5 * wp.dot(before + after, p.normal * n + p.friction)


@wp.kernel
def weigh(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    impulse: wp.array[Impulse],  # (capacity,)
    v: wp.array[wp.vec3],  # (n_vert,) [m/s] by which the step moves
    # in, out
    strike: wp.array[Strike],  # (capacity,)
    # out, added to
    worlds: Worlds,  # those with a strike are open
    any: wp.array[int],  # (1,) 1 where one strikes
):
    """For each contact: whether it strikes in this step, and what stopping it took."""
    for c in range(wp.tid(), n_contact[0], threads):
        to = strike[c]
        if to.speed > 0.0:
            at = contact[c]
            if impulse[c].normal > 0.0:
                worlds.open[worlds.of_vert[at.vert[0]]] = FIRST_LOOK
                any[0] = 1
                u = relative_velocity(at, v) - to.kick
                to.taken = energy_taken(to.u, u, impulse[c], at.normal)
            else:
                to.speed = OPEN
            strike[c] = to


@wp.kernel
def leave_open(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    strike: wp.array[Strike],  # (capacity,)
    # in, out
    constraint: wp.array[Constraint],  # (capacity,)
):
    """For each contact that strikes in the next step: it does not answer before."""
    for c in range(wp.tid(), n_contact[0], threads):
        if strike[c].speed > 0.0:
            constraint[c].inv_mass = 0.0
