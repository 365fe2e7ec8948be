"""The threads of USD."""

import os

from pxr import Work


def one_thread() -> None:
    """Let USD work in the thread that calls it, unless ``PXR_WORK_THREAD_LIMIT`` says otherwise.

    Its other threads wait for work without rest, and a frame of a run has hardly any for them.
    To be called before USD does anything in the process: after that, one of them waits for ever.
    """
    if "PXR_WORK_THREAD_LIMIT" not in os.environ:
        Work.SetConcurrencyLimit(1)
