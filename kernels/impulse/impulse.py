"""Stage 5, impulses: normal impulses and Coulomb friction, all contacts at once, by mass splitting.

    u = sum a_k v_k                              relative velocity              [m/s]
    lambda <- max(0, lambda - (u . n + c) / W_t) c > 0: how fast it may close  [N s]
    p_t <- p_t - u_t / W_t, |p_t| <= mu lambda                                  [N s]
    v_k += a_k (d lambda n + d p_t) / m_k        with the whole mass

The symbols a_k, c and W_t are those of constraint.py; the result is u . n >= -c. tangent.py says
how a gap and a leaning facet change u_t, p_t and W_t.

Each contact sees the share m_k / N_k of a vertex, so a plain sweep cannot add kinetic energy
(Tonge, Benevolenski and Voroshilov 2012). The impulses of a contact are equal and opposite, so
momentum is kept exactly. A fixed vertex has 1 / m = 0 and keeps its prescribed velocity.

Sweep j starts from impulses extrapolated by (j - 1) / (j + 2) of the last change, as in Nesterov's
method, except at contacts where that change went too far. The last sweep is a plain one. Most
contacts converge soon, a few clusters late. Between the first and the last sweep of a world
(worlds.py) a contact is left alone while neither its impulses nor the velocities of its vertices
change.
"""

import warp as wp

from warp_contact.kernels.impulse.constraint import Constraint, Impulse
from warp_contact.kernels.impulse.tangent import allowed
from warp_contact.kernels.lengths import CLOSURE_TOLERANCE
from warp_contact.kernels.mobility import Mobility, mobility_of
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.narrow_phase.contact_graph import ContactGraph, takes_part, total
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import DONE, LAST, Worlds, ask

wp.set_module_options(OPTIONS)


@wp.struct
class Limits:
    """When the sweeps end."""

    tolerance: float  # of an edge: approach in a step that needs another sweep
    sweeps: int  # at most
    extrapolation: float  # 1, or 0 for plain sweeps


@wp.func
def is_quiet(c: Contact, changed: wp.array[int], sweep: int) -> bool:
    """Whether the sweep before changed no vertex that takes part in a contact."""
    for k in range(5):
        if takes_part(c, k) and changed[c.vert[k]] == sweep - 1:
            return False
    return True


@wp.func
def clear_parts(c: int, part: wp.array[wp.vec3]):
    for k in range(5):
        part[5 * c + k] = wp.vec3(0.0, 0.0, 0.0)


@wp.func
def part_of(k: int, c: Contact, to: Constraint, p: wp.vec3) -> wp.vec3:
    """The part of a contact's impulse p at its vertex k, with the torque across the gap [N s]."""
    return c.coef[k] * p + to.gap * wp.dot(to.turn[k], p) * c.normal


@wp.func
def rubs(to: Constraint) -> bool:
    """Whether a contact has tangential impulses."""
    return to.friction > 0.0 or wp.length_sq(to.ramp) > 0.0


@wp.func
def surface_velocity(c: Contact, to: Constraint, v: wp.array[wp.vec3]) -> wp.vec3:
    """u, relative to the turning of the other surface where that matters [m/s]."""
    u = wp.vec3(0.0, 0.0, 0.0)
    for k in range(5):
        vk = v[c.vert[k]]
        u += c.coef[k] * vk
        if rubs(to):
            u += to.gap * wp.dot(c.normal, vk) * to.turn[k]
    return u


@wp.func
def projected(
    before: Impulse, u: wp.vec3, un: float, excess: float, n: wp.vec3, to: Constraint, w: float
) -> Impulse:
    """The allowed impulses nearest to a step from ``ahead``, by 1 / w against the velocity."""
    y = before.ahead
    new = Impulse()
    new.normal = wp.max(y[3] - excess / w, 0.0)
    if rubs(to):
        along = wp.vec3(y[0], y[1], y[2]) - (u - un * n) / w
        new.friction = allowed(along, new.normal, to.friction, to.ramp)
    return new


@wp.func
def agree(a: float, b: float) -> bool:
    """Whether both have the same sign; of tiny bodies their product would be 0 in float32."""
    return (a > 0.0 and b > 0.0) or (a < 0.0 and b < 0.0)


@wp.func
def ahead_of(new: Impulse, before: Impulse, beta: float) -> wp.vec4:
    """The impulses extrapolated by beta; not at all where the last change went too far."""
    b = beta
    if agree(before.ahead[3] - new.normal, new.normal - before.normal):
        b = 0.0
    normal = new.normal + b * (new.normal - before.normal)
    friction = new.friction + b * (new.friction - before.friction)
    return wp.vec4(friction[0], friction[1], friction[2], normal)


@wp.func
def set_parts(
    c: int,
    at: Contact,
    to: Constraint,
    before: wp.vec4,
    after: wp.vec4,
    sweep: int,
    part: wp.array[wp.vec3],
    served: wp.array[int],
) -> wp.vec3:
    """Set the parts of contact c for a change of its impulses; that of both together [N s]."""
    p = (after[3] - before[3]) * at.normal + wp.vec3(after[0], after[1], after[2])
    p -= wp.vec3(before[0], before[1], before[2])
    for k in range(5):
        part[5 * c + k] = part_of(k, at, to, p)
        served[at.vert[k]] = sweep
    return p


@wp.kernel
def solve_contacts(
    # in
    threads: int,
    limits: Limits,
    dt: wp.array[float],  # (n_vert,) [s]
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    changed: wp.array[int],  # (n_vert,) last sweep if it changed the velocity
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # in, out
    impulse: wp.array[Impulse],  # (capacity,) accumulated in this step; v includes ``ahead``
    busy: wp.array[int],  # (capacity,) 2 if this sweep changed the impulses, 1 negligibly, 0 not
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
        whole = last or sweep == 1
        if not whole and busy[c] < 2 and is_quiet(at, changed, sweep):
            if busy[c] == 1:
                busy[c] = 0
                clear_parts(c, part)
            continue
        to = constraint[c]
        w = to.inv_mass_turning
        if w == 0.0:
            busy[c] = 0
            clear_parts(c, part)
            continue
        n = at.normal
        u = surface_velocity(at, to, v)
        un = wp.dot(u, n)
        excess = un + wp.max(to.gap_bound, 0.0)
        before = impulse[c]
        new = projected(before, u, un, excess, n, to, w)
        off = wp.abs(new.normal - before.ahead[3]) * w * dt[at.vert[0]]
        if off > limits.tolerance * at.edge_length:
            ask(worlds, world, limits.sweeps, off > CLOSURE_TOLERANCE * at.edge_length)
        beta = float(0.0)
        if not last:
            beta = limits.extrapolation * float(sweep - 1) / float(sweep + 2)
        new.ahead = ahead_of(new, before, beta)
        change = set_parts(c, at, to, before.ahead, new.ahead, sweep, part, served)
        negligible = worlds.negligible[world]
        busy[c] = wp.where(wp.length(change) * w * dt[at.vert[0]] > negligible, 2, 1)
        impulse[c] = new


@wp.kernel
def apply_impulses(
    # in
    threads: int,
    graph: ContactGraph,
    part: wp.array[wp.vec3],  # (5 capacity,) [N s]
    bodies: Mobility,
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    received: wp.array[wp.vec3],  # (n_vert,) [N s] since the frame began
):
    """For each vertex with contacts: add their impulses."""
    for k in range(wp.tid(), graph.n_touched[0], threads):
        i = graph.touched[k]
        p = total(i, graph, part)
        v[i] = v[i] + mobility_of(i, bodies) * p
        received[i] = received[i] + p


@wp.kernel
def apply_sweep(
    # in
    threads: int,
    worlds: Worlds,
    dt: wp.array[float],  # (n_vert,) [s]
    graph: ContactGraph,
    part: wp.array[wp.vec3],  # (5 capacity,) [N s]
    bodies: Mobility,
    served: wp.array[int],  # (n_vert,) this sweep where it adds something
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    received: wp.array[wp.vec3],  # (n_vert,) [N s] since the frame began
    # out
    changed: wp.array[int],  # (n_vert,) this sweep where it changed the velocity, else 0
):
    """For each vertex to which this sweep of its world adds something: add it."""
    sweep = worlds.sweep[0]
    for k in range(wp.tid(), graph.n_touched[0], threads):
        i = graph.touched[k]
        world = worlds.of_vert[i]
        if worlds.doing[world] == DONE or served[i] != sweep:
            continue
        p = total(i, graph, part)
        g = mobility_of(i, bodies)
        v[i] = v[i] + g * p
        received[i] = received[i] + p
        changed[i] = wp.where(wp.length(p) * g * dt[i] > worlds.negligible[world], sweep, 0)
