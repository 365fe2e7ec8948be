"""Residual overlaps after the impulses, for the closure and the search."""

import warp as wp

from warp_contact.data.launch import launch_over
from warp_contact.data.model import Model
from warp_contact.data.work import Work
from warp_contact.kernels.surface import residual as kernels
from warp_contact.kernels.worlds import FIRST_LOOK, SECOND_LOOK


def find_gaps(model: Model, x: wp.array, work: Work) -> None:
    """Set ``surface.residual`` at ``x``, and whether any of it is to be closed or searched."""
    work.surface.of_looks.zero_()
    add_gaps(model, x, work)


def find_gaps_left(model: Model, x: wp.array, work: Work) -> None:
    """The same after the first closure, where worlds with an overlap before it count alone."""
    work.surface.of_look.zero_()
    add_gaps(model, x, work, SECOND_LOOK)


def add_gaps(model: Model, x: wp.array, work: Work, look: int = FIRST_LOOK) -> None:
    """The same, but what was to be closed or searched before in this step stays so.

    Where impulses were exchanged twice, edges may have moved on since: the closure and its second
    look then run although nothing overlaps at ``x``.
    """
    c = work.contacts
    launch_over(
        kernels.residual_gaps,
        work.capacity.contacts,
        inputs=[look, c.n, c.record, c.constraint, work.dt, x],
        outputs=[work.surface.residual, work.worlds, work.surface.found],
    )


def add_strays(model: Model, x: wp.array, v: wp.array, work: Work) -> None:
    """Count vertices that slid off the triangle of their contact, or lie below it, as overlaps.

    ``v`` are the velocities by which they came to ``x`` in this step.
    """
    c = work.contacts
    launch_over(
        kernels.find_strays,
        work.capacity.contacts,
        inputs=[c.n, c.record, work.dt, x, v],
        outputs=[work.worlds, work.surface.found],
    )
