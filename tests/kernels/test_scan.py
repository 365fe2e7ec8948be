"""scan.py: running sums in place, by one thread and by chunks of many."""

import numpy as np
import pytest
import warp as wp

from warp_contact.data import scan


@pytest.mark.parametrize("inclusive", [True, False])
@pytest.mark.parametrize("n", [1, 2, 63, 64, 65, 4096, 4097, 300_000])
@pytest.mark.parametrize("chunk", [None, 64])
def test_running_sums_are_those_of_numpy(rng, n, inclusive, chunk):
    counts = rng.integers(0, 5, n).astype(np.int32)
    values, scratch = wp.array(counts, dtype=int), scan.allocate(300_000)
    if chunk is None:
        scan.scan(values, scratch, inclusive)
    else:  # as on a GPU
        scan._scan_in_chunks(values, scratch, inclusive, chunk)
    sums = np.cumsum(counts)
    np.testing.assert_array_equal(values.numpy(), sums if inclusive else sums - counts)


def test_scratch_serves_again_and_again(rng):
    scratch = scan.allocate(10_000)
    for n in (10_000, 70, 5_000, 1):
        counts = rng.integers(0, 5, n).astype(np.int32)
        values = wp.array(counts, dtype=int)
        scan._scan_in_chunks(values, scratch, True, scan.CHUNK)
        np.testing.assert_array_equal(values.numpy(), np.cumsum(counts))
