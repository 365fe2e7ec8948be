"""Running sums within a capture: ``wp.utils.array_scan`` allocates its scratch on a GPU."""

import warp as wp

from warp_contact.kernels import scan as kernels

CHUNK = 64  # values that a thread sums on a GPU


def allocate(longest: int) -> list[wp.array]:
    """Scratch for arrays of at most so many values: the sums of chunks, level by level, and 0."""
    sizes = [longest]
    while sizes[-1] > 1:
        sizes.append(-(-sizes[-1] // CHUNK))
    return [wp.zeros(n, dtype=int) for n in sizes[1:] or [1]]


def scan(values: wp.array, scratch: list[wp.array], inclusive: bool) -> None:
    """Replace ``values`` by their running sums, with or without each one's own.

    One thread of a CPU has them all. On a GPU each has ``CHUNK``, in two launches a level.
    """
    if values.device.is_cpu:
        _scan_in_chunks(values, scratch, inclusive, values.shape[0])
    else:
        _scan_in_chunks(values, scratch, inclusive, CHUNK)


def _scan_in_chunks(values: wp.array, scratch: list[wp.array], inclusive: bool, chunk: int) -> None:
    levels, n = [values], values.shape[0]
    while n > chunk:
        n = -(-n // chunk)
        total = scratch[len(levels) - 1][:n]
        wp.launch(kernels.sum_chunks, dim=n, inputs=[chunk, levels[-1]], outputs=[total])
        levels.append(total)
    before = scratch[-1]  # the last level, of one value, is never a sum: it stays 0
    for level in reversed(levels):
        n = -(-level.shape[0] // chunk)
        own = int(inclusive and level is values)
        wp.launch(kernels.scan_chunks, dim=n, inputs=[chunk, own, before], outputs=[level])
        before = level
