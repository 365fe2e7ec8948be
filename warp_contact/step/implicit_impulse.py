"""Impulses and displacements of contacts where some bodies take implicit steps."""

import warp as wp

from warp_contact.data.launch import launch_over
from warp_contact.data.model import Model
from warp_contact.data.work import Work
from warp_contact.kernels.impulse import implicit as kernels
from warp_contact.step.implicit import answer


def find_rows(model: Model, work: Work) -> None:
    """Set the row sums in ``work.mobility``, from the contacts of each vertex."""
    w, c = work.implicit, work.contacts
    w.share.zero_()
    work.mobility.row.zero_()
    launch_over(
        kernels.find_shares, model.n_vert, inputs=[c.graph, c.record], outputs=[w.share]
    )
    inputs = [c.graph, w.share, w.bodies]
    launch_over(kernels.find_rows, model.n_vert, inputs=inputs, outputs=[work.mobility.row])


def apply(model: Model, v: wp.array, work: Work) -> None:
    """Add the parts of the contacts to ``v``, and to the impulses of the frame."""
    w, c = work.implicit, work.contacts
    w.impulse.zero_()
    outputs = [w.impulse, work.forces.received]
    launch_over(kernels.collect, model.n_vert, inputs=[c.graph, c.part], outputs=outputs)
    _add(model, v, work)


def apply_sweep(model: Model, v: wp.array, work: Work) -> None:
    """The same of one sweep, in worlds that sweep."""
    w, c, s = work.implicit, work.contacts, work.sweeps
    w.impulse.zero_()
    launch_over(
        kernels.collect_sweep,
        model.n_vert,
        inputs=[work.worlds, c.graph, c.part, s.served],
        outputs=[w.impulse, work.forces.received],
    )
    answer(model, w.impulse, w.answer, w)
    inputs = [work.worlds, work.dt, w.impulse, w.answer, w.bodies]
    wp.launch(kernels.add_sweep, model.n_vert, inputs=inputs, outputs=[v, s.changed])


def add_parts(model: Model, y: wp.array, work: Work, moves: wp.array) -> None:
    """Add the parts of the contacts to ``y``, positions or velocities, in worlds where ``moves``."""
    w, c = work.implicit, work.contacts
    w.impulse.zero_()
    inputs = [c.graph, c.part, work.worlds, moves]
    launch_over(kernels.collect_moves, model.n_vert, inputs=inputs, outputs=[w.impulse])
    _add(model, y, work)


def _add(model: Model, y: wp.array, work: Work) -> None:
    w = work.implicit
    answer(model, w.impulse, w.answer, w)
    inputs = [w.impulse, w.answer, w.bodies]
    wp.launch(kernels.add, model.n_vert, inputs=inputs, outputs=[y])
