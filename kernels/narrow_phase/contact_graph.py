"""The contacts at each vertex, as a list sorted by contact: sums over it repeat bit for bit.

An entry is 5 c + k for vertex k of contact c. A vertex of weight zero has one too: it may receive a
part of a couple.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.sorting import sort

wp.set_module_options(OPTIONS)


@wp.func
def takes_part(c: int, k: int, vert: wp.array2d[int], coef: wp.array2d[float]) -> bool:
    """Whether vertex k of contact c can receive an impulse; unused places repeat a vertex."""
    if coef[c, k] != 0.0:
        return True
    if vert[c, 2] == vert[c, 0]:
        return False
    if k == 1 or k == 4:
        return vert[c, k] != vert[c, k - 1]
    return True


@wp.kernel
def total_contacts(
    # in
    hits: wp.array[int],  # (1,) vertices' contacts
    crossings: wp.array[int],  # (1,) edges' contacts, behind them
    places: wp.array[int],  # (1,) taken by edges' contacts, with gaps between them
    capacity: int,
    # out
    n_contact: wp.array[int],  # (1,)
    # out, added to
    needed: wp.array[int],  # largest number that did not fit
):
    """One thread: the number of contacts."""
    n = hits[0] + crossings[0]
    n_contact[0] = wp.min(n, capacity)
    if wp.max(n, places[0]) > capacity:
        wp.atomic_max(needed, 0, wp.max(n, places[0]))


@wp.kernel
def count_entries(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    # out
    n_touched: wp.array[int],  # (1,) 0: ``sort_entries`` counts them
    # out, added to
    count: wp.array[int],  # (n_vert + 1,)
):
    """For each contact."""
    if wp.tid() == 0:
        n_touched[0] = 0
    for c in range(wp.tid(), n_contact[0], threads):
        for k in range(5):
            if takes_part(c, k, vert, coef):
                wp.atomic_add(count, vert[c, k], 1)


@wp.kernel
def fill_entries(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    # in, out
    start: wp.array[int],  # (n_vert + 1,) ends of the lists in, their starts out
    # out
    entry: wp.array[int],  # (5 capacity,)
):
    """For each contact: write its entries, from the end of each list downwards."""
    for c in range(wp.tid(), n_contact[0], threads):
        for k in range(5):
            if takes_part(c, k, vert, coef):
                entry[wp.atomic_sub(start, vert[c, k], 1) - 1] = 5 * c + k


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
def total(i: int, start: wp.array[int], entry: wp.array[int], part: wp.array[wp.vec3]) -> wp.vec3:
    """Sum of the parts of the contacts of vertex i, in their order."""
    p = wp.vec3(0.0, 0.0, 0.0)
    for e in range(start[i], start[i + 1]):
        p += part[entry[e]]
    return p


@wp.kernel
def add_parts(
    # in
    threads: int,
    n_touched: wp.array[int],  # (1,)
    touched: wp.array[int],  # (n_vert,)
    start: wp.array[int],  # (n_vert + 1,)
    entry: wp.array[int],  # (5 capacity,)
    part: wp.array[wp.vec3],  # (5 capacity,) [kg y]
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    # in, out
    y: wp.array[wp.vec3],  # (n_vert,) positions or velocities
):
    """For each vertex with contacts: add their parts."""
    for k in range(wp.tid(), n_touched[0], threads):
        i = touched[k]
        if inv_mass[i] > 0.0:
            y[i] = y[i] + inv_mass[i] * total(i, start, entry, part)
