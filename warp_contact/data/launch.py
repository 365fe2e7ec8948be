"""Launches over lists that are partly in use, and stages that run on a condition.

On the CPU threads run one after another. Each loads all arguments of its kernel first, which costs
more than an unused entry of a list. Kernels over lists therefore take the number of threads, and
thread t handles the entries t, t + threads, t + 2 threads and so on. On the CPU one thread handles
all of them, on a GPU each handles one.
"""

from collections.abc import Callable
from functools import partial

import warp as wp

ON_CPU = 1  # threads for a whole list on a CPU; another number gives the same bits, later


def launch_over(kernel: wp.Kernel, n: int, inputs: list, outputs: list) -> None:
    """Launch ``kernel``, whose first argument is the number of threads, over ``n`` entries."""
    threads = min(ON_CPU, n) if wp.get_device().is_cpu else n
    wp.launch(kernel, dim=threads, inputs=[threads, *inputs], outputs=outputs)


def if_any(flag: wp.array, stage: Callable, *arguments, otherwise: Callable | None = None) -> None:
    """Run a stage with its arguments where ``flag``, shape (1,), is not 0; else ``otherwise``.

    The device decides, so that the whole can be captured. ``otherwise`` takes no arguments.
    """
    wp.capture_if(flag, partial(stage, *arguments), otherwise)


def while_any(flag: wp.array, stage: Callable, *arguments) -> None:
    """Run a stage again and again as long as ``flag``, shape (1,), is not 0."""
    wp.capture_while(flag, partial(stage, *arguments))
