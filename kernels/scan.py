"""Running sums of counts, in place, without memory of their own: a capture may hold them.

    out_i = sum of in_j over j < i (exclusive) or j <= i (inclusive)

One thread has a chunk of them. The sums of chunks are summed in the same way, level by level, until
one chunk is left.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.kernel
def sum_chunks(
    # in
    chunk: int,  # values of a chunk
    value: wp.array[int],  # (n,)
    # out
    total: wp.array[int],  # (n_chunk,)
):
    """One thread per chunk: the sum of its values."""
    k = wp.tid()
    s = int(0)
    for i in range(k * chunk, wp.min((k + 1) * chunk, value.shape[0])):
        s += value[i]
    total[k] = s


@wp.kernel
def scan_chunks(
    # in
    chunk: int,  # values of a chunk
    inclusive: bool,
    before: wp.array[int],  # (n_chunk,) sum of all chunks before each one
    # in, out
    value: wp.array[int],  # (n,)
):
    """One thread per chunk: its running sums."""
    k = wp.tid()
    s = before[k]
    for i in range(k * chunk, wp.min((k + 1) * chunk, value.shape[0])):
        v = value[i]
        if inclusive:
            value[i] = s + v
        else:
            value[i] = s
        s += v
