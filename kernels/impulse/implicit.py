"""Impulses of the contacts where some bodies take implicit steps.

    dv = G p                                    p summed over the contacts of a vertex  [m/s]
    t_i = sum_j |G_ij| s_j,  s_j = sum_c |a_c|  over the contacts c of vertex j         [1/kg]

G is 1 / m for lumped vertices. An impulse on one vertex moves all vertices of a body, so sweeps
over all contacts at once need another bound than mass splitting: sum_k |a_k| t_k bounds the sum of
a row of the matrix J G J^T of all contacts, by the triangle inequality.
"""

import warp as wp

from warp_contact.kernels.implicit.mobility import LUMPED, Implicit, moves
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.narrow_phase.contact_graph import ContactGraph, total
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import DONE, Worlds

wp.set_module_options(OPTIONS)

ROOM = wp.constant(1.1)  # on the row sums: G differs a little from S, of which the norms are


@wp.kernel
def find_shares(
    # in
    threads: int,
    graph: ContactGraph,
    contact: wp.array[Contact],  # (capacity,)
    # out
    share: wp.array[float],  # (n_vert,) s_j; the host clears it first
):
    """For each vertex with contacts: how much it takes part in them."""
    for k in range(wp.tid(), graph.n_touched[0], threads):
        i = graph.touched[k]
        s = float(0.0)
        for e in range(graph.start[i], graph.start[i + 1]):
            n = graph.entry[e]
            s += wp.abs(contact[n // 5].coef[n % 5])
        share[i] = s


@wp.kernel
def find_rows(
    # in
    threads: int,
    graph: ContactGraph,
    share: wp.array[float],  # (n_vert,)
    d: Implicit,
    # out
    row: wp.array[float],  # (n_vert,) t_i; the host clears it first
):
    """For each vertex with contacts, of a body that takes implicit steps: its row sum."""
    for k in range(wp.tid(), graph.n_touched[0], threads):
        i = graph.touched[k]
        b = d.vert_body[i]
        if moves(b, d) and d.inv_mass[i] > 0.0:
            first = d.body_vert[b]
            n = d.body_vert[b + 1] - first
            at = d.first[b] + (i - first) * n
            s = float(0.0)
            for j in range(n):
                s += d.norm[at + j] * share[first + j]
            row[i] = ROOM * s


@wp.kernel
def collect(
    # in
    threads: int,
    graph: ContactGraph,
    part: wp.array[wp.vec3],  # (5 capacity,) [N s]
    # out
    p: wp.array[wp.vec3],  # (n_vert,) [N s]; the host clears it first
    # out, added to
    received: wp.array[wp.vec3],  # (n_vert,) [N s] since the frame began
):
    """For each vertex with contacts: the sum of their impulses."""
    for k in range(wp.tid(), graph.n_touched[0], threads):
        i = graph.touched[k]
        p[i] = total(i, graph, part)
        received[i] = received[i] + p[i]


@wp.kernel
def collect_sweep(
    # in
    threads: int,
    worlds: Worlds,
    graph: ContactGraph,
    part: wp.array[wp.vec3],  # (5 capacity,) [N s]
    served: wp.array[int],  # (n_vert,) this sweep where it adds something
    # out
    p: wp.array[wp.vec3],  # (n_vert,) [N s]; the host clears it first
    # out, added to
    received: wp.array[wp.vec3],  # (n_vert,) [N s] since the frame began
):
    """For each vertex to which this sweep of its world adds something: what it adds."""
    for k in range(wp.tid(), graph.n_touched[0], threads):
        i = graph.touched[k]
        if worlds.doing[worlds.of_vert[i]] != DONE and served[i] == worlds.sweep[0]:
            p[i] = total(i, graph, part)
            received[i] = received[i] + p[i]


@wp.kernel
def collect_moves(
    # in
    threads: int,
    graph: ContactGraph,
    part: wp.array[wp.vec3],  # (5 capacity,) [kg y]
    worlds: Worlds,
    moving: wp.array[int],  # (n_world,) not 0 where there is something to add
    # out
    p: wp.array[wp.vec3],  # (n_vert,) [kg y]; the host clears it first
):
    """For each vertex with contacts, in worlds that move: the sum of their parts."""
    for k in range(wp.tid(), graph.n_touched[0], threads):
        i = graph.touched[k]
        if moving[worlds.of_vert[i]] > 0:
            p[i] = total(i, graph, part)


@wp.kernel
def add(
    # in
    p: wp.array[wp.vec3],  # (n_vert,) [kg y]
    answer: wp.array[wp.vec3],  # (n_vert,) [y] G p of bodies that take implicit steps
    d: Implicit,
    # in, out
    y: wp.array[wp.vec3],  # (n_vert,) velocities or positions
):
    """One thread per vertex: add G p."""
    i = wp.tid()
    if d.inv_mass[i] > 0.0:
        if d.kind[d.vert_body[i]] == LUMPED:
            y[i] = y[i] + d.inv_mass[i] * p[i]
        else:
            y[i] = y[i] + answer[i]


@wp.kernel
def add_sweep(
    # in
    worlds: Worlds,
    dt: wp.array[float],  # (n_vert,) [s]
    p: wp.array[wp.vec3],  # (n_vert,) [N s]
    answer: wp.array[wp.vec3],  # (n_vert,) [m/s] G p of bodies that take implicit steps
    d: Implicit,
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    changed: wp.array[int],  # (n_vert,) this sweep where it changed the velocity, else 0
):
    """One thread per vertex: add G p, and say whether that matters to other contacts."""
    i = wp.tid()
    changed[i] = 0
    if d.inv_mass[i] > 0.0:
        u = answer[i]
        if d.kind[d.vert_body[i]] == LUMPED:
            u = d.inv_mass[i] * p[i]
        if wp.length_sq(u) > 0.0:
            v[i] = v[i] + u
            if wp.length(u) * dt[i] > worlds.negligible[worlds.of_vert[i]]:
                changed[i] = worlds.sweep[0]
