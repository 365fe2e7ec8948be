"""The contacts at each vertex, in a list sorted by contact: sums over it repeat bit for bit.

An entry is 5 c + k for vertex k of contact c. A vertex of weight zero has one too: it may receive a
part of a torque.
"""

import warp as wp

from warp_contact.kernels.mobility import Mobility, mobility_of
from warp_contact.kernels.narrow_phase.contact import Contact, meets_body
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.sorting import sort
from warp_contact.kernels.worlds import Worlds

wp.set_module_options(OPTIONS)


@wp.struct
class ContactGraph:
    """Which contacts each vertex has."""

    start: wp.array[int]  # (n_vert + 1,) first entry of each vertex
    entry: wp.array[int]  # (5 capacity,)
    n_touched: wp.array[int]  # (1,) vertices with entries
    touched: wp.array[int]  # (n_vert,) which ones, in any order


@wp.func
def takes_part(c: Contact, k: int) -> bool:
    """Whether vertex k of a contact can receive an impulse; unused places repeat a vertex."""
    if c.coef[k] != 0.0:
        return True
    if not meets_body(c):
        return False
    if k == 1 or k == 4:
        return c.vert[k] != c.vert[k - 1]
    return True


@wp.kernel
def total_contacts(
    # in
    of_verts: wp.array[int],  # (1,) contacts
    of_edges: wp.array[int],  # (1,) contacts, behind them
    places: wp.array[int],  # (1,) places taken by contacts of edges, some unused
    capacity: int,
    # out
    n_contact: wp.array[int],  # (1,)
    # out, added to
    needed: wp.array[int],  # (1,) largest number that did not fit
):
    """One thread: the number of contacts, and what did not fit."""
    n = of_verts[0] + of_edges[0]
    n_contact[0] = wp.min(n, capacity)
    if wp.max(n, places[0]) > capacity:
        wp.atomic_max(needed, 0, wp.max(n, places[0]))


@wp.kernel
def count_entries(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    # out
    n_touched: wp.array[int],  # (1,) 0: ``sort_entries`` counts them
    # out, added to
    count: wp.array[int],  # (n_vert + 1,)
):
    """For each contact: count its entries."""
    if wp.tid() == 0:
        n_touched[0] = 0
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        for k in range(5):
            if takes_part(at, k):
                wp.atomic_add(count, at.vert[k], 1)


@wp.kernel
def fill_entries(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    # in, out
    start: wp.array[int],  # (n_vert + 1,) ends of the lists in, their starts out
    # out
    entry: wp.array[int],  # (5 capacity,)
):
    """For each contact: write its entries, from the end of each list downwards."""
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        for k in range(5):
            if takes_part(at, k):
                entry[wp.atomic_sub(start, at.vert[k], 1) - 1] = 5 * c + k


@wp.kernel
def sort_entries(
    # in
    threads: int,
    start: wp.array[int],  # (n_vert + 1,)
    # in, out
    entry: wp.array[int],  # (5 capacity,)
    # out
    touched: wp.array[int],  # (n_vert,) vertices with entries, in any order
    # out, added to
    n_touched: wp.array[int],  # (1,)
):
    """For each vertex: sort its list, which is short."""
    for i in range(wp.tid(), start.shape[0] - 1, threads):
        if start[i] < start[i + 1]:
            sort(entry, start[i], start[i + 1])
            touched[wp.atomic_add(n_touched, 0, 1)] = i


@wp.func
def contacts_of(i: int, graph: ContactGraph) -> int:
    """Number of contacts of vertex i."""
    return graph.start[i + 1] - graph.start[i]


@wp.func
def total(i: int, graph: ContactGraph, part: wp.array[wp.vec3]) -> wp.vec3:
    """Sum of the parts of the contacts of vertex i, in their order."""
    p = wp.vec3(0.0, 0.0, 0.0)
    for e in range(graph.start[i], graph.start[i + 1]):
        p += part[graph.entry[e]]
    return p


@wp.kernel
def add_parts(
    # in
    threads: int,
    graph: ContactGraph,
    part: wp.array[wp.vec3],  # (5 capacity,) [kg y]
    bodies: Mobility,
    worlds: Worlds,
    moves: wp.array[int],  # (n_world,) not 0 where there is something to add
    # in, out
    y: wp.array[wp.vec3],  # (n_vert,) positions or velocities
):
    """For each vertex with contacts, in worlds that move: add their parts."""
    for k in range(wp.tid(), graph.n_touched[0], threads):
        i = graph.touched[k]
        if mobility_of(i, bodies) > 0.0 and moves[worlds.of_vert[i]] > 0:
            y[i] = y[i] + mobility_of(i, bodies) * total(i, graph, part)
