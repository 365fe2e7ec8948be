"""Repeated sweeps over the contacts: in each world as long as a contact asks for another."""

from collections.abc import Callable

import warp as wp

from warp_contact.data.launch import while_any
from warp_contact.data.work import Work
from warp_contact.kernels import worlds as kernels


def repeat(work: Work, look: int, one_more: bool, sweep: Callable, *arguments) -> None:
    """Run ``sweep`` with its arguments until no contact asks for another.

    Only in worlds where the ``look`` found an overlap; with ``one_more``, once more after that.
    """
    s = work.sweeps
    s.running.zero_()
    outputs = [work.worlds, s.running]
    wp.launch(kernels.begin_sweeps, dim=_n(work), inputs=[look], outputs=outputs)
    while_any(s.running, _sweep, work, one_more, sweep, *arguments)


def count(work: Work, one_more: bool) -> None:
    """Count a sweep, and end those of worlds that need no other."""
    outputs = [work.worlds, work.sweeps.running]
    wp.launch(kernels.next_sweep, dim=_n(work), inputs=[one_more], outputs=outputs)


def _sweep(work: Work, one_more: bool, sweep: Callable, *arguments) -> None:
    sweep(*arguments)
    count(work, one_more)


def _n(work: Work) -> int:
    return work.worlds.doing.shape[0]
