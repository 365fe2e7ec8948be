"""Motors of attachments within a step. Where none drives anything, nothing of this runs."""

import warp as wp

from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.ties import drive as kernels
from warp_contact.kernels.ties.motor import look
from warp_contact.step import implicit, ties


def drive(model: Model, state: State, work: Work) -> None:
    """Let motors act in a step, and hold the ties: in place of ``ties.hold``."""
    again(model, state, work)
    ties.hold(model, state, work)
    _push(model, state, work, kernels.FURTHER)
    ties.hold(model, state, work)
    _look(model, state, work, False)


def again(model: Model, state: State, work: Work) -> None:
    """Let the forces of the last step act for ``work.dt``; ``work.x`` is where that leads."""
    t = work.ties
    inputs, outputs = [state.x, work.implicit.bodies, t.attachments], [t.ties, t.motors]
    wp.launch(kernels.respond, t.n_cluster, inputs=inputs, outputs=outputs)
    _push(model, state, work, kernels.AGAIN)
    implicit.drift(model, state, work, work.x)


def finish(model: Model, state: State, work: Work) -> None:
    """Keep the forces of the step, and what contacts took; before the drift."""
    _look(model, state, work, True)


def _push(model: Model, state: State, work: Work, round: int) -> None:
    t, w, x, v = work.ties, work.implicit, state.x, state.v
    implicit.rigid_part(model, v, x, w)
    wp.copy(w.before, v)
    inputs = [round, work.dt, x, v, w.bodies, w.of, t.attachments]
    wp.launch(kernels.drive, t.n_cluster, inputs=inputs, outputs=[t.ties, t.motors])
    wp.launch(kernels.add_motion, model.n_vert, inputs=[x, w.bodies, t.motors], outputs=[v])
    # Without ties a motor may turn a thin body very fast: no place to look for open ties.
    ties.settle(model, v, work, keeps=True)


def _look(model: Model, state: State, work: Work, last: bool) -> None:
    t, w, x, v = work.ties, work.implicit, state.x, state.v
    implicit.rigid_part(model, v, x, w)
    inputs = [last, work.dt, x, v, w.bodies, w.of, t.attachments, t.ties]
    wp.launch(look, t.n_attachment, inputs=inputs, outputs=[t.motors])
