"""Repeated sweeps over the contacts: a first one, more as long as any contact asks for another."""

from collections.abc import Callable

import warp as wp

from warp_contact.data.launch import while_any
from warp_contact.data.work import Work
from warp_contact.kernels.impulse import impulse as kernels


def repeat(work: Work, sweep: Callable, *arguments) -> None:
    """Run ``sweep`` with its arguments until it leaves ``sweeps.again`` at 0."""
    count(work, first=True)
    sweep(*arguments)
    while_any(work.sweeps.again, _again, work, sweep, *arguments)


def count(work: Work, first: bool = False) -> None:
    """Count a sweep, from 1 on if it is the first, and ask for no other yet."""
    outputs = [work.sweeps.again, work.sweeps.number]
    wp.launch(kernels.next_sweep, dim=1, inputs=[first], outputs=outputs)


def _again(work: Work, sweep: Callable, *arguments) -> None:
    count(work)
    sweep(*arguments)
