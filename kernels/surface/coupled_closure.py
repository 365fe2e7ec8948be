"""Stage 8, closure, where some bodies take implicit steps: by the row sums of impulse/rows.py.

    p <- max(0, p - (g + slack) / W),   dx = G sum_c a_c dp_c n_c

A stiff body is moved so, not strained. The passes start from extrapolated pushes, as the sweeps of
the impulses do; the last one is plain.
"""

import warp as wp

from warp_contact.kernels.impulse.constraint import Constraint
from warp_contact.kernels.impulse.impulse import agree, clear_parts
from warp_contact.kernels.impulse.rows import row_weight
from warp_contact.kernels.lengths import CLOSURE_TOLERANCE
from warp_contact.kernels.narrow_phase.contact import Contact, gap
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import DONE, LAST, Worlds, ask

wp.set_module_options(OPTIONS)


@wp.kernel
def begin_pushes(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    slack: wp.array[float],  # (capacity,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    ahead: wp.array[float],  # (capacity,) [kg m] 0
    counted: wp.array[int],  # (capacity,) 1 where the contact overlaps
):
    """For each contact: no push yet, and whether it counts."""
    for c in range(wp.tid(), n_contact[0], threads):
        ahead[c] = 0.0
        counted[c] = wp.where(gap(contact[c], x) + slack[c] < 0.0, 1, 0)


@wp.kernel
def solve_gaps(
    # in
    threads: int,
    passes: int,  # at most
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    slack: wp.array[float],  # (capacity,) [m]
    row: wp.array[float],  # (n_vert,) [1/kg]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    push: wp.array[float],  # (capacity,) [kg m]
    ahead: wp.array[float],  # (capacity,) [kg m] extrapolated; x includes it
    counted: wp.array[int],  # (capacity,)
    # out
    part: wp.array[wp.vec3],  # (5 capacity,) [kg m] what it moves at each vertex
    served: wp.array[int],  # (n_vert,) this pass where it adds something
    # out, added to
    worlds: Worlds,  # those where an overlap is left
):
    """For each contact of a world that is being closed: what this pass adds to its push."""
    sweep = worlds.sweep[0]
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        world = worlds.of_vert[at.vert[0]]
        if worlds.doing[world] == DONE:
            continue
        clear_parts(c, part)
        if constraint[c].inv_mass == 0.0:
            continue
        last = worlds.doing[world] == LAST
        g = gap(at, x) + slack[c]
        if g < -CLOSURE_TOLERANCE * at.edge_length:
            ask(worlds, world, passes, True)
        if counted[c] == 0 and g >= 0.0:
            continue
        for k in range(5):
            served[at.vert[k]] = sweep
        if counted[c] == 0:  # the row sums will count it in the next pass
            counted[c] = 2
            continue
        counted[c] = 1
        p = wp.max(ahead[c] - g / row_weight(at, row), 0.0)
        beta = float(0.0)
        if not last and not agree(ahead[c] - p, p - push[c]):
            beta = float(sweep - 1) / float(sweep + 2)
        next = p + beta * (p - push[c])
        for k in range(5):
            part[5 * c + k] = at.coef[k] * (next - ahead[c]) * at.normal
        push[c] = p
        ahead[c] = next
