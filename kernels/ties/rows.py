"""Row sums of contacts on bodies that hang together: bounds as in impulse/rows.py, by less.

    t_i = sum_j |G'_ij| s_j,   G'_ij = G_ij - C_i^T C_j,   C_i = L^-1 (J G)_i          [1/kg]

G' is the mobility that contacts see where ties hold. A light pad on a heavy finger hardly moves by
what would throw it, were it free: by the rows of G the sweeps would take ten times as long. Where
more vertices of a cluster have contacts than there is room for, its rows stay those of G.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import Implicit
from warp_contact.kernels.impulse.rows import ROOM, Shares, Touched
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.ties.matrix import held_across, response
from warp_contact.kernels.ties.tie import HELD, Ties

wp.set_module_options(OPTIONS)

LEAST = wp.constant(wp.float64(1.0e-3))  # part of |G_ii| that |G'_ii| counts as, at least


@wp.struct
class Rows:
    """Vertices with contacts of each cluster, and how they answer each other."""

    first_body: wp.array[int]  # (n_cluster + 1,) first of each in ``body``
    body: wp.array[int]  # (n,) bodies of each cluster that can move; none if one is lumped
    first: wp.array[int]  # (n_cluster + 1,) first slot of each
    cluster: wp.array[int]  # (n_slot,)
    column: wp.array[int]  # (n_cluster,) first of its columns
    block: wp.array[int]  # (n_cluster,) first of its norms
    n: wp.array[int]  # (n_cluster,) slots in use
    vert: wp.array[int]  # (n_slot,) the vertices, ascending within a body
    columns: wp.array[wp.mat33d]  # (n_column,) C_i by slot and tie
    norms: wp.array[float]  # (n_norm,) |G'_ij| by slots [1/kg]


@wp.kernel
def list_slots(
    # in
    threads: int,
    touched: Touched,
    d: Implicit,
    # in, out
    rows: Rows,
):
    """For each cluster: its vertices with contacts, none where there are too many."""
    for c in range(wp.tid(), rows.n.shape[0], threads):
        first = rows.first[c]
        n = int(0)
        for e in range(rows.first_body[c], rows.first_body[c + 1]):
            b = rows.body[e]
            for k in range(touched.n[b]):
                if first + n < rows.first[c + 1]:
                    rows.vert[first + n] = touched.vert[d.body_vert[b] + k]
                n += 1
        rows.n[c] = wp.where(first + n > rows.first[c + 1], 0, n)


@wp.kernel
def find_columns(
    # in
    threads: int,
    ties: Ties,
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # in, out
    rows: Rows,
):
    """For each slot: C_i of its vertex."""
    for s in range(wp.tid(), rows.cluster.shape[0], threads):
        c = rows.cluster[s]
        if s - rows.first[c] >= rows.n[c]:
            continue
        first = ties.first[c]
        n = ties.first[c + 1] - first
        at = rows.column[c] + (s - rows.first[c]) * n
        for t in range(n):
            a = wp.mat33d()
            if ties.state[first + t] == HELD:
                v = ties.vert[first + t]
                w = ties.now[first + t]
                for k in range(8):
                    if w[k] != 0.0:
                        a += wp.float64(w[k]) * response(v[k], rows.vert[s], x, d)
                a = held_across(ties.line[first + t]) @ a
            row = ties.block[c] + t * n
            for k in range(t):
                a -= ties.matrix[row + k] @ rows.columns[at + k]
            rows.columns[at + t] = ties.matrix[row + t] @ a


@wp.func
def norm_of(a: wp.mat33d) -> wp.float64:
    """A bound on the spectral norm of a matrix."""
    across = wp.float64(0.0)
    down = wp.float64(0.0)
    for k in range(3):
        across = wp.max(across, wp.abs(a[k, 0]) + wp.abs(a[k, 1]) + wp.abs(a[k, 2]))
        down = wp.max(down, wp.abs(a[0, k]) + wp.abs(a[1, k]) + wp.abs(a[2, k]))
    return wp.sqrt(wp.min(across * down, wp.ddot(a, a)))


@wp.kernel
def find_norms(
    # in
    threads: int,
    ties: Ties,
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # in, out
    rows: Rows,
):
    """For each slot: how its vertex answers impulses at the others of the cluster."""
    for s in range(wp.tid(), rows.cluster.shape[0], threads):
        c = rows.cluster[s]
        first = rows.first[c]
        if s - first >= rows.n[c]:
            continue
        n = ties.first[c + 1] - ties.first[c]
        own = rows.column[c] + (s - first) * n
        at = rows.block[c] + (s - first) * (rows.first[c + 1] - first)
        for k in range(rows.n[c]):
            g = response(rows.vert[s], rows.vert[first + k], x, d)
            least = wp.float64(0.0)
            if first + k == s:
                least = LEAST * norm_of(g)
            for t in range(n):
                other = rows.columns[rows.column[c] + k * n + t]
                g -= wp.transpose(rows.columns[own + t]) @ other
            rows.norms[at + k] = wp.float32(wp.max(norm_of(g), least))


@wp.kernel
def set_rows(
    # in
    threads: int,
    share: Shares,
    rows: Rows,
    d: Implicit,
    # out
    row: wp.array[float],  # (n_vert,) [1/kg]
):
    """For each slot: the row sum of its vertex."""
    for s in range(wp.tid(), rows.cluster.shape[0], threads):
        c = rows.cluster[s]
        first = rows.first[c]
        if s - first >= rows.n[c] or d.inv_mass[rows.vert[s]] == 0.0:
            continue
        at = rows.block[c] + (s - first) * (rows.first[c + 1] - first)
        sum = float(0.0)
        for k in range(rows.n[c]):
            sum += rows.norms[at + k] * share.of_vert[rows.vert[first + k]]
        row[rows.vert[s]] = ROOM * sum
