"""Row sums of the contacts where some bodies take implicit steps: bounds for coupled.py.

    t_i = sum_j |G_ij| s_j,  s_j = sum_c |a_c|  over the contacts c of vertex j         [1/kg]
    W = sum_k |a_k| t_k                                                                 [1/kg]

An impulse on one vertex moves all vertices of such a body, so the sweeps need another bound than
mass splitting: W bounds the sum of a row of the matrix J G J^T of all contacts, by the triangle
inequality. Only contacts that may move count, those with an impulse or an approach. Contacts that
begin to count are added to the sums at once, those that no longer push are left out at every sweep
of a multiple of RECOUNT.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import FOUR, RIGID, Implicit, block_of, moves
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.narrow_phase.contact_graph import ContactGraph
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

ROOM = wp.constant(1.1)  # on the row sums: G differs a little from S, of which the norms are
RECOUNT = wp.constant(8)  # sweeps until contacts that no longer push are no longer counted


@wp.struct
class Touched:
    """The vertices of each body that have contacts."""

    n: wp.array[int]  # (n_body,) how many
    vert: wp.array[int]  # (n_vert,) which, ascending, from the first vertex of their body on


@wp.struct
class Shares:
    """How much the vertices take part in the contacts that count."""

    of_vert: wp.array[float]  # (n_vert,) s_j
    n: wp.array[int]  # (n_body,) how many changed in this sweep
    vert: wp.array[int]  # (n_vert,) which, from the first vertex of their body on
    by: wp.array[float]  # (n_vert,) by how much, in the same places


@wp.kernel
def list_touched(
    # in
    threads: int,
    body_vert: wp.array[int],  # (n_body + 1,)
    graph: ContactGraph,
    # out
    to: Touched,
):
    """For each body: its vertices with contacts."""
    for b in range(wp.tid(), body_vert.shape[0] - 1, threads):
        first = body_vert[b]
        last = body_vert[b + 1]
        n = int(0)
        if graph.start[first] < graph.start[last]:
            for i in range(first, last):
                if graph.start[i] < graph.start[i + 1]:
                    to.vert[first + n] = i
                    n += 1
        to.n[b] = n


@wp.func
def share_of(
    i: int, graph: ContactGraph, contact: wp.array[Contact], counted: wp.array[int]
) -> float:
    """Share s of vertex i, over the contacts that count."""
    s = float(0.0)
    for e in range(graph.start[i], graph.start[i + 1]):
        n = graph.entry[e]
        if counted[n // 5] > 0:
            s += wp.abs(contact[n // 5].coef[n % 5])
    return s


@wp.func
def begins(i: int, graph: ContactGraph, counted: wp.array[int]) -> bool:
    """Whether a contact of vertex i begins to count in this sweep."""
    for e in range(graph.start[i], graph.start[i + 1]):
        if counted[graph.entry[e] // 5] == 2:
            return True
    return False


@wp.func
def first_of_four(i: int, graph: ContactGraph, d: Implicit) -> int:
    """First of the four vertices of vertex i, if none of them before i has contacts; else -1."""
    first = i - (i - d.body_vert[d.vert_body[i]]) % FOUR
    for j in range(first, i):
        if graph.start[j] < graph.start[j + 1]:
            return -1
    return first


@wp.func
def rigid_row_sum(
    i: int, share: Shares, touched: Touched, x: wp.array[wp.vec3], d: Implicit
) -> float:
    """Row sum t of vertex i of a rigid body [1/kg]."""
    b = d.vert_body[i]
    first = d.body_vert[b]
    s = float(0.0)
    arm = float(0.0)
    for k in range(touched.n[b]):
        j = touched.vert[first + k]
        s += share.of_vert[j]
        arm += share.of_vert[j] * wp.length(x[j] - d.centre[b])
    c = d.inv_inertia[b]  # its norm is at most that of Frobenius
    norm = wp.sqrt(wp.ddot(c, c))
    if not wp.isfinite(norm):  # its squares, of a tiny body
        scale = wp.trace(c)
        norm = scale * wp.sqrt(wp.ddot(c / scale, c / scale))
    own = wp.length(x[i] - d.centre[b])
    return ROOM * (d.inv_total[b] * s + norm * own * arm)


@wp.func
def set_row_sums(
    four: int,
    anew: bool,
    graph: ContactGraph,
    share: Shares,
    touched: Touched,
    x: wp.array[wp.vec3],
    d: Implicit,
    row: wp.array[float],
):
    """Set the row sums t of those of four vertices that have contacts, or add to them [1/kg]."""
    b = d.vert_body[four]
    first = d.body_vert[b]
    dense = moves(b, d) and d.kind[b] != RIGID
    sums = wp.vec4()
    if dense:
        at = block_of(four, d) - first
        if anew:
            for k in range(touched.n[b]):
                j = touched.vert[first + k]
                sums += share.of_vert[j] * d.norm[at + j]
        else:
            for k in range(first, first + share.n[b]):
                sums += share.by[k] * d.norm[at + share.vert[k]]
    for k in range(FOUR):
        i = four + k
        if i < d.body_vert[b + 1] and graph.start[i] < graph.start[i + 1]:
            if d.inv_mass[i] == 0.0:
                row[i] = 0.0
            elif dense:
                row[i] = ROOM * sums[k] + wp.where(anew, 0.0, row[i])
            elif d.kind[b] == RIGID and d.awake[b] != 0:
                row[i] = rigid_row_sum(i, share, touched, x, d)
            else:
                row[i] = d.inv_mass[i] * share.of_vert[i]


@wp.kernel
def count_all(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    # out
    counted: wp.array[int],  # (capacity,) 1
):
    """For each contact: it counts."""
    for c in range(wp.tid(), n_contact[0], threads):
        counted[c] = 1


@wp.kernel
def find_shares(
    # in
    threads: int,
    graph: ContactGraph,
    contact: wp.array[Contact],  # (capacity,)
    counted: wp.array[int],  # (capacity,)
    # out
    share: Shares,  # those of the vertices
    served: wp.array[int],  # (n_vert,) 0: nothing yet
    changed: wp.array[int],  # (n_vert,) 0: nothing yet
):
    """For each vertex with contacts: how much it takes part in those that count."""
    for k in range(wp.tid(), graph.n_touched[0], threads):
        i = graph.touched[k]
        share.of_vert[i] = share_of(i, graph, contact, counted)
        served[i] = 0
        changed[i] = 0


@wp.kernel
def find_rows(
    # in
    threads: int,
    graph: ContactGraph,
    touched: Touched,
    share: Shares,
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # out
    row: wp.array[float],  # (n_vert,) t_i
):
    """For each vertex with contacts, four at once: its row sum."""
    for k in range(wp.tid(), graph.n_touched[0], threads):
        four = first_of_four(graph.touched[k], graph, d)
        if four >= 0:
            set_row_sums(four, True, graph, share, touched, x, d, row)


@wp.func
def row_weight(c: Contact, row: wp.array[float]) -> float:
    """W of a contact [1/kg]."""
    w = float(0.0)
    for k in range(5):
        w += wp.abs(c.coef[k]) * row[c.vert[k]]
    return w
