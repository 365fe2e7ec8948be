"""Pairs of the broad phase: a vertex and a body with tets of it, an edge and one with triangles.

The vertex or edge is the owner, the tets or triangles are the items. Threads append (owner, item)
in any order. A counting sort by owner and a sort of the items of each owner leave no trace of that
order. Items are numbered by body, so those of a pair follow each other.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.sorting import sort

wp.set_module_options(OPTIONS)

MOST = wp.constant(2**31 - 1)  # stands for a count beyond it


@wp.struct
class PairList:
    """Vertices (or edges), the bodies that they may touch, and with which tets (or triangles)."""

    n: wp.array[int]  # (1,) number of pairs
    pair: wp.array[wp.vec2i]  # (capacity,) owner and body, in this order
    start: wp.array[int]  # (n_owner + 1,) first pair of each owner
    items: wp.array[wp.vec2i]  # (capacity,) first and end of each pair in ``item``
    item: wp.array[int]  # (capacity of items,) tets or triangles, ascending for each owner


@wp.func
def append(owner: int, item: int, found: wp.array[wp.vec2i], n_found: wp.array[int]):
    """Append to a list; an entry that does not fit is only counted."""
    k = wp.atomic_add(n_found, 0, 1)
    if k >= 0 and k < found.shape[0]:  # a body that explodes may count beyond 2^31, to -2^31
        found[k] = wp.vec2i(owner, item)


@wp.func
def all_fit(n: int, capacity: int, needed: wp.array[int]) -> bool:
    """Whether so many entries fit, or ``needed`` is set; a count that came round does not."""
    if n >= 0 and n <= capacity:
        return True
    wp.atomic_max(needed, 0, wp.where(n < 0, MOST, n))
    return False


@wp.kernel
def count_items(
    # in
    threads: int,
    n_found: wp.array[int],  # (1,)
    found: wp.array[wp.vec2i],  # (capacity,) owner and item
    # out, added to
    count: wp.array[int],  # (n_owner + 1,)
    needed: wp.array[int],  # (1,) largest number of items that did not fit
):
    """For each item: count it for its owner; none is counted when they do not fit."""
    if not all_fit(n_found[0], found.shape[0], needed):
        return
    for k in range(wp.tid(), n_found[0], threads):
        wp.atomic_add(count, found[k][0], 1)


@wp.kernel
def fill_items(
    # in
    threads: int,
    n_found: wp.array[int],  # (1,)
    found: wp.array[wp.vec2i],  # (capacity,)
    # in, out
    start: wp.array[int],  # (n_owner + 1,) ends of the lists in, their starts out
    # out
    item: wp.array[int],  # (capacity,) by owner, unsorted
):
    """For each item: write it into the list of its owner."""
    if n_found[0] > found.shape[0]:
        return
    for e in range(wp.tid(), n_found[0], threads):
        k = n_found[0] - 1 - e  # lists are filled from their ends
        item[wp.atomic_sub(start, found[k][0], 1) - 1] = found[k][1]


@wp.kernel
def count_pairs(
    # in
    threads: int,
    item_body: wp.array[int],  # (n,)
    start: wp.array[int],  # (n_owner + 1,)
    # in, out
    item: wp.array[int],  # (capacity,) sorted on return
    # out
    count: wp.array[int],  # (n_owner + 1,)
):
    """For each owner: sort its items and count their bodies."""
    for i in range(wp.tid(), start.shape[0] - 1, threads):
        n = int(0)
        body = int(-1)
        sort(item, start[i], start[i + 1])
        for e in range(start[i], start[i + 1]):
            if item_body[item[e]] != body:
                body = item_body[item[e]]
                n += 1
        count[i] = n


@wp.kernel
def list_pairs(
    # in
    threads: int,
    item_body: wp.array[int],  # (n,)
    start: wp.array[int],  # (n_owner + 1,)
    item: wp.array[int],  # (capacity,)
    pair_start: wp.array[int],  # (n_owner + 1,)
    # out
    n_pair: wp.array[int],  # (1,) 0 when they do not fit
    pair: wp.array[wp.vec2i],  # (capacity,) owner and body
    items: wp.array[wp.vec2i],  # (capacity,) first and end in ``item``
    # out, added to
    needed: wp.array[int],  # (1,) largest number of pairs that did not fit
):
    """For each owner: its pairs, bodies in ascending order."""
    total = pair_start[pair_start.shape[0] - 1]
    if total > pair.shape[0]:
        n_pair[0] = 0
        wp.atomic_max(needed, 0, total)
        return
    n_pair[0] = total
    for i in range(wp.tid(), start.shape[0] - 1, threads):
        c = pair_start[i]
        first = start[i]
        while first < start[i + 1]:
            body = item_body[item[first]]
            end = int(first)
            while end < start[i + 1] and item_body[item[wp.min(end, item.shape[0] - 1)]] == body:
                end += 1
            pair[c] = wp.vec2i(i, body)
            items[c] = wp.vec2i(first, end)
            c += 1
            first = end


@wp.kernel
def any_pairs(
    # in
    verts: wp.array[int],  # (1,)
    edges: wp.array[int],  # (1,)
    # out
    any_pair: wp.array[int],  # (1,) 1 when there are pairs of either kind
):
    """One thread: whether there is any pair."""
    any_pair[0] = wp.where(verts[0] + edges[0] > 0, 1, 0)
