"""Restitution: what strikes in a step parts at its end. Without coefficients nothing of this runs.

See ``kernels/impulse/strike.py`` and ``rebound.py``.
"""

from dataclasses import replace

import warp as wp

from warp_contact.data.launch import if_any, launch_over
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.impulse import rebound as kernels
from warp_contact.kernels.impulse.strike import weigh as weigh_strikes
from warp_contact.kernels.worlds import FIRST_LOOK
from warp_contact.step import coupled, implicit, impulse, ties

ROUNDS = 2  # of making what gave back too much slower
TOLERANCE = 1e-5  # of an edge, in place of that of coupled.py: what is too fast gains energy


def weigh(v: wp.array, work: Work) -> None:
    """Find the contacts that strike, when the velocities ``v`` of the step are known."""
    r, c = work.rebound, work.contacts
    r.any.zero_()
    r.worlds.open.zero_()
    inputs = [c.n, c.record, c.impulse, v]
    outputs = [r.strike, r.worlds, r.any]
    launch_over(weigh_strikes, work.capacity.contacts, inputs=inputs, outputs=outputs)


def part(model: Model, state: State, work: Work) -> None:
    """Let the sides of these part, at the positions and velocities at the end of the step."""
    if_any(work.rebound.any, _part, model, state, work)


def _part(model: Model, state: State, work: Work) -> None:
    r, c, m = work.rebound, work.rebound.contacts, work.capacity.contacts
    at_end = replace(work, contacts=c, worlds=r.worlds)
    implicit.place(model, state.x, work.implicit)
    if work.ties:
        ties.find_matrix(state.x, work)
    inputs = [c.n, work.contacts.record, state.x]
    launch_over(kernels.follow, m, inputs=inputs, outputs=[c.record])
    impulse.begin(model, state.x, at_end)
    inputs = [model.restitution, c.n, c.record, work.dt, state.v]
    launch_over(kernels.stop, m, inputs=inputs, outputs=[c.constraint, r.strike])
    _solve(model, state, at_end)
    _record(state, work, at_end)
    d, outputs = work.implicit.bodies, [c.constraint, c.impulse, r.strike, r.most]
    r.most.zero_()
    given = [c.n, c.record, model.body_edge, state.v, d]
    launch_over(kernels.part, m, inputs=given, outputs=outputs)
    _solve(model, state, at_end)
    for _ in range(ROUNDS):
        r.given.zero_()
        inputs = [*given, c.impulse, r.strike]
        launch_over(kernels.add_given, m, inputs=inputs, outputs=[r.given])
        inputs = [c.n, c.record, r.strike, r.most, r.given]
        launch_over(kernels.temper, m, inputs=inputs, outputs=[c.constraint])
        _solve(model, state, at_end)
    _record(state, work, at_end)
    inputs, outputs = [c.n, c.n_vertex, c.record, r.strike], [work.warm.partner, work.warm.edges]
    launch_over(kernels.forget, m, inputs=inputs, outputs=outputs)


def _solve(model: Model, state: State, at_end: Work) -> None:
    """Exchange impulses in worlds with a strike."""
    coupled.sweep_all(model, state.v, at_end, FIRST_LOOK, 1.0, TOLERANCE)


def _record(state: State, work: Work, at_end: Work) -> None:
    """Add the impulses at the end of the step to those of the step and the frame."""
    impulse.add_forces(state.x, at_end)
    c, m = at_end.contacts, work.capacity.contacts
    outputs = [work.contacts.impulse]
    launch_over(kernels.add_to_step, m, inputs=[c.n, c.impulse], outputs=outputs)
