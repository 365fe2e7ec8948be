"""Stage 5: normal impulses and Coulomb friction, all contacts at once, by mass splitting.

Contact c has vertices k with signed weights a_k (positive on the side that moves along n).

    u = sum a_k v_k                              relative velocity              [m/s]
    W = sum a_k^2 N_k / m_k                      N_k contacts share vertex k    [1/kg]
    lambda <- max(0, lambda - (u . n + c) / W_c) c = max(0, g0 - rest) / h      [N s]
    p_t <- p_t - u_t / W_c, |p_t| <= mu lambda   W_c = W without the couple     [N s]
    v_k += a_k (d lambda n + d p_t) / m_k        with the whole mass

The gap g0 at the start of the step may close to a resting gap at its end, not further: u . n >= -c.
Without that hair's breadth the ends of an edge on a face would count as inside or outside by
rounding, and stage 2 would lose the edge.

What the gap and a leaning facet do to u_t, p_t and W_c is in tangent.py.

Each contact sees the share m_k / N_k of a vertex, so a plain sweep cannot add kinetic energy
(Tonge, Benevolenski and Voroshilov 2012). Equal and opposite per contact: momentum is kept exactly.
A fixed vertex has 1 / m = 0 and keeps its prescribed velocity.

Sweep j runs from impulses extrapolated by (j - 1) / (j + 2) of the last change, as in Nesterov's
method, except at a contact where that change was a step too far. The last sweep is a plain one.
Most contacts are soon done, and few clusters last long: between the first and the last sweep a
contact is left alone while neither its impulses nor the velocities of its vertices change.
"""

import warp as wp

from warp_contact.kernels.impulse.tangent import allowed, couple_weight, slope
from warp_contact.kernels.narrow_phase.contact_graph import takes_part, total
from warp_contact.kernels.narrow_phase.gap import REST, gap, gradient
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

TURN = wp.constant(0.1)  # gap times gradient above which a surface cannot take the couple
STEEP = wp.constant(8.0)  # gradient times edge of a triangle too thin or too tilted for it


@wp.kernel
def begin_contacts(
    # in
    threads: int,
    friction: float,  # coefficient
    first: wp.array[int],  # (1,) contacts before this one keep their impulses
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    offset: wp.array[float],  # (capacity,) [m]
    pair: wp.array[wp.vec2i],  # (capacity,)
    start: wp.array[int],  # (n_vert + 1,)
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    body_edge: wp.array[float],  # (n_body,) [m]
    dt: wp.array[float],  # (1,) [s]
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step
    # out
    weight: wp.array[float],  # (capacity,) [1/kg] W
    coupled: wp.array[float],  # (capacity,) [1/kg] W_c
    closing: wp.array[float],  # (capacity,) [m/s] (gap at x0 - gap at rest) / dt
    open: wp.array[float],  # (capacity,) [m] g0, 0 where no surface can take the couple
    turn: wp.array2d[wp.vec3],  # (capacity, 5) [1/m] b_k
    mu: wp.array[float],  # (capacity,) coefficient of friction, 0 across a gap that is too wide
    ramp: wp.array[wp.vec3],  # (capacity,) t, 0 where the facet does not lean
    lam: wp.array[float],  # (capacity,) [N s]
    slip: wp.array[wp.vec3],  # (capacity,) [N s]
    ahead: wp.array[wp.vec4],  # (capacity,) [N s]
):
    """For each contact: W, and no impulse yet on the new ones."""
    for c in range(wp.tid(), n_contact[0], threads):
        w = float(0.0)
        for k in range(5):
            a = coef[c, k]
            i = vert[c, k]
            w += a * a * inv_mass[i] * float(start[i + 1] - start[i])
        weight[c] = w
        coupled[c] = w
        on_plane = pair[c][1] >= body_edge.shape[0]
        g = gap(c, vert, coef, normal, offset, on_plane, x0)
        closing[c] = (g - REST * body_edge[pair[c][0]]) / dt[0]
        open[c] = g
        largest = float(0.0)
        for k in range(5):
            turn[c, k] = wp.vec3(0.0, 0.0, 0.0)
            if w > 0.0 and not on_plane:
                turn[c, k] = gradient(k, c, vert, normal[c], x0)
                largest = wp.max(largest, wp.length(turn[c, k]))
        mu[c] = friction
        ramp[c] = wp.vec3(0.0, 0.0, 0.0)
        if largest * body_edge[pair[c][0]] > STEEP:
            for k in range(5):
                turn[c, k] = wp.vec3(0.0, 0.0, 0.0)
        elif w > 0.0 and not on_plane:
            ramp[c] = slope(c, vert, normal[c], x0)
        if largest * wp.abs(g) > TURN or on_plane:
            open[c] = 0.0
            if not on_plane:
                mu[c] = 0.0
                ramp[c] = wp.vec3(0.0, 0.0, 0.0)
        if open[c] != 0.0 and (mu[c] > 0.0 or wp.length_sq(ramp[c]) > 0.0):
            coupled[c] = w + couple_weight(c, vert, coef, start, inv_mass, open, turn)
        if c >= first[0]:
            lam[c] = 0.0
            slip[c] = wp.vec3(0.0, 0.0, 0.0)
            ahead[c] = wp.vec4(0.0, 0.0, 0.0, 0.0)


@wp.kernel
def next_sweep(
    # in
    first: bool,
    # out
    again: wp.array[int],  # (1,) 0
    # in, out
    done: wp.array[int],  # (1,) sweeps so far
):
    """One thread: count a sweep."""
    again[0] = 0
    if first:
        done[0] = 0
    done[0] = done[0] + 1


@wp.func
def is_quiet(
    c: int, vert: wp.array2d[int], coef: wp.array2d[float], stirred: wp.array[int], sweep: int
) -> bool:
    """Whether no vertex that takes part in contact c was stirred by the sweep before."""
    for k in range(5):
        if takes_part(c, k, vert, coef) and stirred[vert[c, k]] == sweep - 1:
            return False
    return True


@wp.kernel
def solve_contacts(
    # in
    threads: int,
    tolerance: float,  # of an edge: approach in a step that needs another sweep
    little: float,  # [m] a change in a step that nobody needs to know of
    sweeps: int,  # at most
    dt: wp.array[float],  # (1,) [s]
    body_edge: wp.array[float],  # (n_body,) [m]
    pair: wp.array[wp.vec2i],  # (capacity,)
    done: wp.array[int],  # (1,) sweeps so far
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    coupled: wp.array[float],  # (capacity,) [1/kg] W_c
    closing: wp.array[float],  # (capacity,) [m/s]
    open: wp.array[float],  # (capacity,) [m]
    turn: wp.array2d[wp.vec3],  # (capacity, 5) [1/m]
    mu: wp.array[float],  # (capacity,)
    ramp: wp.array[wp.vec3],  # (capacity,)
    stirred: wp.array[int],  # (n_vert,) the last sweep if it changed the velocity
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    last: bool,  # leave the impulses where this sweep projects them
    # in, out
    lam: wp.array[float],  # (capacity,) [N s] accumulated normal impulse
    slip: wp.array[wp.vec3],  # (capacity,) [N s] accumulated tangential impulse
    ahead: wp.array[wp.vec4],  # (capacity,) [N s] extrapolated tangential and normal impulse, in v
    busy: wp.array[int],  # (capacity,) 2 when this sweep changed the impulses, 1 little, 0 not
    # out
    part: wp.array[wp.vec3],  # (5 capacity,) [N s] what this sweep adds at each vertex
    served: wp.array[int],  # (n_vert,) this sweep where it adds something
    # out, added to
    again: wp.array[int],  # (1,) 1 when another sweep is needed
):
    """For each contact: update its accumulated impulses."""
    sweep = done[0]
    whole = last or sweep == 1
    for c in range(wp.tid(), n_contact[0], threads):
        if not whole and busy[c] < 2 and is_quiet(c, vert, coef, stirred, sweep):
            if busy[c] == 1:
                busy[c] = 0
                for k in range(5):
                    part[5 * c + k] = wp.vec3(0.0, 0.0, 0.0)
            continue
        if coupled[c] == 0.0:
            busy[c] = 0
            for k in range(5):
                part[5 * c + k] = wp.vec3(0.0, 0.0, 0.0)
            continue
        n = normal[c]
        rubs = mu[c] > 0.0 or wp.length_sq(ramp[c]) > 0.0
        u = wp.vec3(0.0, 0.0, 0.0)
        for k in range(5):
            w = v[vert[c, k]]
            u += coef[c, k] * w
            if rubs:
                u += open[c] * wp.dot(n, w) * turn[c, k]
        un = wp.dot(u, n)
        excess = un + wp.max(closing[c], 0.0)
        y = ahead[c]
        yt = wp.vec3(y[0], y[1], y[2])
        new_lam = wp.max(y[3] - excess / coupled[c], 0.0)
        off = wp.abs(new_lam - y[3]) * coupled[c]
        if off * dt[0] > tolerance * body_edge[pair[c][0]] and sweep < sweeps:
            again[0] = 1
        new_slip = wp.vec3(0.0, 0.0, 0.0)
        if rubs:
            new_slip = allowed(yt - (u - un * n) / coupled[c], new_lam, mu[c], ramp[c])
        beta = float(0.0)
        if not last:
            beta = float(sweep - 1) / float(sweep + 2)
        if (y[3] - new_lam) * (new_lam - lam[c]) > 0.0:
            beta = 0.0
        next_lam = new_lam + beta * (new_lam - lam[c])
        next_slip = new_slip + beta * (new_slip - slip[c])
        change = (next_lam - y[3]) * n + next_slip - yt
        for k in range(5):
            part[5 * c + k] = coef[c, k] * change + open[c] * wp.dot(turn[c, k], change) * n
            served[vert[c, k]] = sweep
        busy[c] = wp.where(wp.length(change) * coupled[c] * dt[0] > little, 2, 1)
        ahead[c] = wp.vec4(next_slip[0], next_slip[1], next_slip[2], next_lam)
        lam[c] = new_lam
        slip[c] = new_slip


@wp.kernel
def apply_impulses(
    # in
    threads: int,
    swept: bool,  # only what this sweep changed
    little: float,  # [m] a change in a step that nobody needs to know of
    dt: wp.array[float],  # (1,) [s]
    done: wp.array[int],  # (1,) sweeps so far
    n_touched: wp.array[int],  # (1,)
    touched: wp.array[int],  # (n_vert,)
    start: wp.array[int],  # (n_vert + 1,)
    entry: wp.array[int],  # (5 capacity,)
    part: wp.array[wp.vec3],  # (5 capacity,) [N s]
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    served: wp.array[int],  # (n_vert,)
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    impulse: wp.array[wp.vec3],  # (n_vert,) [N s] received since the frame began
    # out
    stirred: wp.array[int],  # (n_vert,) this sweep where it changed the velocity, else 0
):
    """For each vertex with contacts: add their impulses."""
    for k in range(wp.tid(), n_touched[0], threads):
        i = touched[k]
        if swept and served[i] != done[0]:
            continue
        p = total(i, start, entry, part)
        v[i] = v[i] + inv_mass[i] * p
        impulse[i] = impulse[i] + p
        stirred[i] = wp.where(wp.length(p) * inv_mass[i] * dt[0] > little, done[0], 0)
