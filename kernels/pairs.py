"""Candidates by pair: of a vertex and a body with tets of it, of an edge and one with triangles.

Threads append (owner, item) in any order. A counting sort by owner and a sort of each owner's items
leave no trace of that order. Items are numbered by body, so that those of a pair follow each other.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def append(owner: int, item: int, found: wp.array[wp.vec2i], n_found: wp.array[int]):
    """Add to a list; what does not fit is counted all the same."""
    k = wp.atomic_add(n_found, 0, 1)
    if k < found.shape[0]:
        found[k] = wp.vec2i(owner, item)


@wp.kernel
def count_items(
    # in
    n_found: wp.array[int],  # (1,)
    found: wp.array[wp.vec2i],  # (capacity,) owner and item
    # out, added to
    count: wp.array[int],  # (n_owner + 1,)
    needed: wp.array[int],  # (1,) largest number of items that did not fit
):
    """One thread per item; none is counted when they do not fit."""
    k = wp.tid()
    if n_found[0] > found.shape[0]:
        wp.atomic_max(needed, 0, n_found[0])
    elif k < n_found[0]:
        wp.atomic_add(count, found[k][0], 1)


@wp.kernel
def fill_items(
    # in
    n_found: wp.array[int],  # (1,)
    found: wp.array[wp.vec2i],  # (capacity,)
    # in, out
    start: wp.array[int],  # (n_owner + 1,) ends of the lists in, their starts out
    # out
    item: wp.array[int],  # (capacity,) by owner, unsorted
):
    """One thread per item."""
    k = wp.tid()
    if k < n_found[0] and n_found[0] <= found.shape[0]:
        item[wp.atomic_sub(start, found[k][0], 1) - 1] = found[k][1]


@wp.kernel
def count_pairs(
    # in
    item_body: wp.array[int],  # (n,)
    start: wp.array[int],  # (n_owner + 1,)
    # in, out
    item: wp.array[int],  # (capacity,) sorted on return
    # out
    count: wp.array[int],  # (n_owner + 1,)
):
    """One thread per owner: sort its items and count their bodies."""
    i = wp.tid()
    n = int(0)
    body = int(-1)
    for e in range(start[i], start[i + 1]):
        value = item[e]
        k = int(e)
        while k > start[i] and item[wp.max(k - 1, 0)] > value:
            item[k] = item[k - 1]
            k -= 1
        item[k] = value
    for e in range(start[i], start[i + 1]):
        if item_body[item[e]] != body:
            body = item_body[item[e]]
            n += 1
    count[i] = n


@wp.kernel
def list_pairs(
    # in
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
    """One thread per owner: its pairs, bodies in ascending order."""
    i = wp.tid()
    total = pair_start[pair_start.shape[0] - 1]
    if total > pair.shape[0]:
        n_pair[0] = 0
        wp.atomic_max(needed, 0, total)
        return
    n_pair[0] = total
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
    some: wp.array[int],  # (1,) 1 when there are pairs of either kind
):
    """One thread."""
    some[0] = wp.where(verts[0] + edges[0] > 0, 1, 0)
