"""What the sweeps need of each contact: set once, when the contacts of a step are known.

Contact c has vertices k with signed weights a_k (positive on the side that moves along n).

    W = sum a_k^2 N_k / m_k                      N_k contacts share vertex k    [1/kg]
    W_t = W and what the torque adds             tangent.py                     [1/kg]
    c = (g0 - rest) / h                          gap bound                      [m/s]

W is the inverse effective mass: each contact sees the share m_k / N_k of a vertex. W_t includes the
torque. c is how fast the sides may approach: the gap g0 at the start of the step may close to the
resting gap at its end, not further. Without a resting gap, rounding would decide whether the ends
of an edge on a face are inside, and the narrow phase would lose the edge.
"""

import warp as wp

from warp_contact.kernels.impulse.tangent import mat53, slope, torque_weight
from warp_contact.kernels.lengths import REST_GAP
from warp_contact.kernels.mobility import Mobility, mobility_of, row_of
from warp_contact.kernels.narrow_phase.contact import Contact, gap, gradient
from warp_contact.kernels.narrow_phase.contact_graph import ContactGraph, contacts_of
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

TURN = wp.constant(0.1)  # gap times gradient, above which the surface cannot take the torque
WIDE = wp.constant(0.1)  # the same, above which there is no friction
COUNTED = wp.constant(1.0)  # part of the torque's weight that the sweeps count
TILTED = wp.constant(8.0)  # gradient times edge, above which a facet is too thin or tilted for it


@wp.struct
class Constraint:
    """The constants of one contact in a step."""

    inv_mass: float  # W [1/kg], 0 where nothing can move
    inv_mass_turning: float  # W_t [1/kg]
    gap_bound: float  # c [m/s], negative for less than the resting gap at the start of the step
    gap: float  # g0 [m], 0 where no surface can take the torque
    turn: mat53  # b_k [1/m]
    friction: float  # coefficient, 0 across a gap that is too wide
    ramp: wp.vec3  # t of tangent.py, 0 where the facet does not lean
    parting: float  # [m/s] of its sides, of rebound.py, else 0


@wp.struct
class Impulse:
    """The impulses of one contact in a step."""

    normal: float  # lambda [N s]
    friction: wp.vec3  # p_t [N s]
    ahead: wp.vec4  # both extrapolated, p_t first [N s]


@wp.func
def inverse_mass(c: Contact, graph: ContactGraph, bodies: Mobility) -> float:
    """W of a contact [1/kg]."""
    w = float(0.0)
    for k in range(5):
        a = c.coef[k]
        i = c.vert[k]
        row = row_of(i, bodies)
        if row > 0.0:
            w += wp.abs(a) * row
        else:
            w += a * a * mobility_of(i, bodies) * float(contacts_of(i, graph))
    return w


@wp.func
def least_closing(to: Constraint) -> float:
    """How fast the sides may close [m/s]; negative where they have to part."""
    return wp.max(to.gap_bound, 0.0) - to.parting


@wp.func
def coefficient(pair: wp.vec2i, friction: wp.array[float]) -> float:
    """Coulomb coefficient between two bodies: the mean of theirs."""
    return 0.5 * (friction[pair[0]] + friction[pair[1]])


@wp.kernel
def begin_contacts(
    # in
    threads: int,
    friction: wp.array[float],  # (n_body + n_plane,)
    first: wp.array[int],  # (1,) contacts before this one keep their impulses
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    graph: ContactGraph,
    bodies: Mobility,
    dt: wp.array[float],  # (n_vert,) [s]
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step
    # out
    constraint: wp.array[Constraint],  # (capacity,)
    impulse: wp.array[Impulse],  # (capacity,)
):
    """For each contact: its constants, and no impulse yet on the new ones."""
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        to = Constraint()
        w = inverse_mass(at, graph, bodies)
        to.inv_mass = w
        to.inv_mass_turning = w
        to.gap = gap(at, x0)
        to.gap_bound = (to.gap - REST_GAP * at.edge_length) / dt[at.vert[0]]
        to.friction = coefficient(at.pair, friction)
        largest = float(0.0)
        if w > 0.0 and not at.on_plane:
            for k in range(5):
                to.turn[k] = gradient(k, at, x0)
                largest = wp.max(largest, wp.length(to.turn[k]))
        if largest * at.edge_length > TILTED:
            to.turn = mat53()
        elif w > 0.0 and not at.on_plane:
            to.ramp = slope(at, x0)
        across = largest * wp.abs(to.gap)
        if across > WIDE and not at.on_plane:
            to.friction = 0.0
            to.ramp = wp.vec3(0.0, 0.0, 0.0)
        if across > TURN or at.on_plane:
            to.gap = 0.0
        if to.gap != 0.0 and (to.friction > 0.0 or wp.length_sq(to.ramp) > 0.0):
            to.inv_mass_turning = w + COUNTED * torque_weight(at, graph, bodies, to.gap, to.turn)
        constraint[c] = to
        if c >= first[0]:
            impulse[c] = Impulse()
