"""Launches over lists of which a part is in use, or has much to do.

On the CPU threads run one after another, and each loads all arguments of its kernel first: more
than an unused entry is worth. Kernels over lists therefore take the number of their threads and
let each have every so-manieth entry: on the CPU one thread has them all, on a GPU each has its own.
"""

import warp as wp


def launch_over(kernel: wp.Kernel, n: int, inputs: list, outputs: list) -> None:
    """Launch ``kernel``, whose first argument is the number of threads, over ``n`` entries."""
    threads = 1 if wp.get_device().is_cpu else n
    wp.launch(kernel, dim=threads, inputs=[threads, *inputs], outputs=outputs)
