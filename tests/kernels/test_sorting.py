"""kernels/sorting.py, and the lists that rely on it, whatever order threads appended in."""

import numpy as np
import warp as wp

from warp_contact.kernels.broad_phase import pairs
from warp_contact.kernels.narrow_phase import contact_graph
from warp_contact.kernels.narrow_phase.contact import Contact


def ints(values) -> wp.array:
    return wp.array(np.asarray(values), dtype=int)


def test_lists_of_every_length_are_sorted(rng, device):
    sizes = np.arange(65)
    start = np.append(0, np.cumsum(sizes))
    lists = [rng.permutation(1000)[:n] for n in sizes]
    for threads in (1, 3, len(sizes)):
        entry = ints(np.concatenate(lists))
        touched, n = ints(np.zeros(len(sizes))), ints([0])
        inputs, outputs = [threads, ints(start)], [entry, touched, n]
        wp.launch(contact_graph.sort_entries, dim=threads, inputs=inputs, outputs=outputs)
        expected = np.concatenate([np.sort(part) for part in lists])
        np.testing.assert_array_equal(entry.numpy(), expected)
        assert sorted(touched.numpy()[: n.numpy()[0]]) == np.flatnonzero(sizes).tolist()


def test_pairs_do_not_depend_on_the_order_in_which_items_were_found(rng, device):
    """Owners with up to 40 items of 7 bodies; no pair twice, bodies in ascending order."""
    item_body = np.sort(rng.integers(0, 7, 60))
    owned = [(i, k) for i in range(9) for k in rng.permutation(60)[: rng.integers(0, 40)]]
    expected = sorted({(i, int(item_body[k])) for i, k in owned})
    n = len(owned)
    for threads in (1, 4, n):
        found = wp.array(rng.permutation(np.array(owned)), dtype=wp.vec2i)
        start, item, needed = ints(np.zeros(10)), ints(np.zeros(n)), ints([0])
        counts = ints(np.zeros(10))
        n_pair, pair, items = ints([0]), *(wp.zeros(n, dtype=wp.vec2i) for _ in range(2))

        def go(kernel, *inputs, out, threads=threads):
            wp.launch(kernel, dim=threads, inputs=[threads, *inputs], outputs=out)

        go(pairs.count_items, ints([n]), found, out=[start, needed])
        wp.utils.array_scan(start, start, inclusive=True)
        go(pairs.fill_items, ints([n]), found, out=[start, item])
        go(pairs.count_pairs, ints(item_body), start, out=[item, counts])
        wp.utils.array_scan(counts, counts, inclusive=False)
        go(
            pairs.list_pairs,
            ints(item_body),
            start,
            item,
            counts,
            out=[n_pair, pair, items, needed],
        )
        assert needed.numpy()[0] == 0 and n_pair.numpy()[0] == len(expected)
        assert [tuple(p) for p in pair.numpy()[: len(expected)].tolist()] == expected
        for (i, body), (first, end) in zip(expected, items.numpy().tolist(), strict=False):
            held = [k for owner, k in owned if owner == i and item_body[k] == body]
            assert item.numpy()[first:end].tolist() == sorted(held)


def test_a_vertex_of_weight_zero_takes_part_and_a_repeated_one_does_not(device):
    vert = np.array([[0, 0, 1, 2, 3], [4, 4, 4, 4, 4], [0, 1, 2, 3, 3]])
    coef = np.float32([[1, 0, -0.5, -0.5, 0], [1, 0, 0, 0, 0], [0, 1, -0.3, -0.7, 0]])
    taking = {(0, 0), (0, 2), (0, 3), (0, 4), (1, 0), (2, 0), (2, 1), (2, 2), (2, 3)}
    records = wp.zeros(3, dtype=Contact).numpy()
    records["vert"], records["coef"] = vert, coef
    n, contacts = wp.array([3], dtype=int), wp.array(records, dtype=Contact)
    count, n_touched = wp.zeros(6, dtype=int), wp.zeros(1, dtype=int)
    inputs = [2, n, contacts]
    wp.launch(contact_graph.count_entries, dim=2, inputs=inputs, outputs=[n_touched, count])
    expected = np.bincount([vert[place] for place in taking], minlength=6)
    np.testing.assert_array_equal(count.numpy(), expected)
    start = wp.array(np.cumsum(expected), dtype=int)
    entry = wp.full(15, -1, dtype=int)
    wp.launch(contact_graph.fill_entries, dim=2, inputs=inputs, outputs=[start, entry])
    assert {divmod(e, 5) for e in entry.numpy()[: len(taking)].tolist()} == taking
