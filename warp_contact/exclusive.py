"""One simulation of a process works at a time, and Warp says little while it does.

Graphs are captured for the whole process: two threads that do so at once would fail, or worse, get
each other's launches. Simulations in several threads are therefore right, but no faster than one
after the other; for more cores take processes.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import warp as wp

_LOCK = threading.RLock()


@contextmanager
def exclusively(device: wp.Device) -> Iterator[None]:
    """On ``device``, alone; kernels that are loaded within are not named unless asked for.

    Warp names them from ``wp.config.log_level`` ``wp.LOG_DEBUG`` on.
    """
    with _LOCK, wp.ScopedDevice(device):
        level = wp.config.log_level
        if level == wp.LOG_INFO:
            wp.config.log_level = wp.LOG_WARNING
        try:
            yield
        finally:
            wp.config.log_level = level
