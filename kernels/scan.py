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
    own: int,  # 1 for inclusive sums, 0 for exclusive ones
    before: wp.array[int],  # (n_chunk,) sum of all chunks before each one
    # in, out
    value: wp.array[int],  # (n,)
):
    """One thread per chunk: its running sums."""
    k = wp.tid()
    s = before[k]
    i = k * chunk
    end = wp.min((k + 1) * chunk, value.shape[0])
    while i + 4 <= end:  # four at a time: half of the time on a CPU
        v0 = value[i]
        v1 = value[i + 1]
        v2 = value[i + 2]
        v3 = value[i + 3]
        s1 = s + v0
        s2 = s1 + v1
        s3 = s2 + v2
        value[i] = s + own * v0
        value[i + 1] = s1 + own * v1
        value[i + 2] = s2 + own * v2
        value[i + 3] = s3 + own * v3
        s = s3 + v3
        i += 4
    while i < end:
        v = value[i]
        value[i] = s + own * v
        s += v
        i += 1
