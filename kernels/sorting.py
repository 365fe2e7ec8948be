"""Sorting a part of a list by one thread, for parts that are short."""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def sort(values: wp.array[int], first: int, end: int):
    """Sort the values from ``first`` to ``end``, in place (Shell 1959).

    In each pass, a value that is in order already costs one comparison.
    """
    gap = (end - first) // 2
    while gap > 0:
        for e in range(first + gap, end):
            value = values[e]
            k = int(e)
            while k >= first + gap and values[wp.max(k - gap, 0)] > value:
                values[k] = values[wp.max(k - gap, 0)]
                k -= gap
            values[k] = value
        gap = gap // 2
