"""Impulses between the bodies until no contact approaches."""

from functools import partial

import warp as wp

from warp_contact.data.launch import if_any, launch_over
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.switches import on
from warp_contact.data.warm_start import forget as forget_last
from warp_contact.data.work import Work
from warp_contact.kernels.impulse import constraint, pair_impulses, strike
from warp_contact.kernels.impulse import impulse as kernels
from warp_contact.kernels.lengths import IMPULSE_TOLERANCE
from warp_contact.kernels.worlds import FIRST_LOOK, NO_LOOK
from warp_contact.step import coupled, residual, sweeps, warm_start
from warp_contact.step.contact_graph import order_by_vertex
from warp_contact.step.narrow_phase import append_edge_contacts

SWEEPS = 48  # at most; few clusters of contacts last so long


def solve(model: Model, state: State, work: Work) -> None:
    """Change ``state.v`` by impulses at the contacts found, starting from the last step's."""
    none = partial(warm_start.forget_edges, work)
    if_any(work.contacts.n, _solve_from_last, model, state, work, otherwise=none)


def add_edges(model: Model, state: State, work: Work) -> None:
    """Add the contacts of edges that were found since; the others keep their impulses."""
    if_any(work.narrow_phase.n_new, _add_edges, model, state, work)


def solve_again(model: Model, state: State, work: Work) -> None:
    """Exchange impulses once more in worlds with an overlap at the positions ``work.x``."""
    residual.find_gaps(model, work.x, work)
    if_any(work.surface.any_open, exchange, model, state.v, work, FIRST_LOOK)


def finish(x: wp.array, work: Work) -> None:
    """Keep the impulses of vertices for the next step; add all, at ``x``, to those of the frame.

    Those of edges were kept by each ``exchange``, which may be followed by another.
    """
    warm_start.keep_vertices(work)
    add_forces(x, work)


def forget(work: Work) -> None:
    """Clear the contacts and what the next step would start from: nothing touches."""
    work.contacts.n_vertex.zero_()
    work.narrow_phase.n_crossing.zero_()
    work.contacts.n.zero_()
    forget_last(work.warm, lacking=not work.ties)  # the end of the step sets it


def begin(model: Model, x0: wp.array, work: Work) -> None:
    """Order the contacts by vertex, and set their constants; none has an impulse yet."""
    _begin(model, x0, work, work.narrow_phase.none)


def exchange(
    model: Model,
    v: wp.array,
    work: Work,
    look: int = NO_LOOK,
    keeps: bool = True,
    finer: bool = False,
) -> None:
    """Change ``v`` by normal impulses and friction until no contact approaches.

    Only in worlds where the ``look`` found an overlap, or in all with ``NO_LOOK``. The contacts of
    edges are kept, with their impulses, for the next step, if it ``keeps`` them. Those of implicit
    steps may be solved ``finer``.
    """
    _sweep_all(model, v, work, look, finer)
    if keeps:
        warm_start.keep_edges(work, look)


def solve_half_step(model: Model, state: State, work: Work) -> None:
    """As ``solve`` for half a step, of which nothing is kept for the next one."""
    begin(model, state.x, work)
    if work.rebound:
        _find_strikes(model, work)
        inputs, outputs = [work.contacts.n, work.rebound.strike], [work.contacts.constraint]
        launch_over(strike.leave_open, work.capacity.contacts, inputs=inputs, outputs=outputs)
    share = 1.0 if work.implicit else 0.5  # those of implicit steps are kept as forces
    warm_start.recall_edges(work, share)
    warm_start.recall_vertices(work, share)
    apply(model, state.v, work)
    exchange(model, state.v, work, keeps=False)


def apply(model: Model, v: wp.array, work: Work) -> None:
    """Add the parts of the contacts to ``v``, and to the impulses of the frame."""
    if work.implicit:
        return coupled.apply(model, v, work)
    c = work.contacts
    launch_over(
        kernels.apply_impulses,
        model.n_vert,
        inputs=[c.graph, c.part, work.mobility],
        outputs=[v, work.forces.received],
    )


def add_forces(x: wp.array, work: Work) -> None:
    """Add the impulses of all contacts, at ``x``, to their pairs of bodies."""
    c, forces = work.contacts, work.forces
    launch_over(
        pair_impulses.add_pair_impulses,
        work.capacity.contacts,
        inputs=[forces.unit, c.n, c.record, c.impulse, x],
        outputs=[forces.pair_key, forces.pair_total, work.overflow.pairs],
    )


def _sweep_all(model: Model, v: wp.array, work: Work, look: int, finer: bool) -> None:
    if work.implicit:
        tolerance = coupled.FINER if finer else coupled.TOLERANCE
        return coupled.sweep_all(model, v, work, look, _limits().extrapolation, tolerance)
    sweeps.repeat(work, look, True, _sweep, model, v, work)


def _solve_from_last(model: Model, state: State, work: Work) -> None:
    begin(model, state.x, work)
    _find_strikes(model, work)
    if on("warm start"):
        warm_start.recall_edges(work)
        warm_start.recall_vertices(work)
        apply(model, state.v, work)
    exchange(model, state.v, work)


def _add_edges(model: Model, state: State, work: Work) -> None:
    append_edge_contacts(model, state.x, work)
    _begin(model, state.x, work, work.contacts.n_vertex)
    _find_strikes(model, work)
    warm_start.recall_edges(work, again=True)


def _begin(model: Model, x0: wp.array, work: Work, first: wp.array) -> None:
    """Contacts from number ``first``, shape (1,), on have no impulse yet; others keep theirs."""
    c = work.contacts
    order_by_vertex(model, work)
    if work.implicit:
        coupled.begin(model, work)
    launch_over(
        constraint.begin_contacts,
        work.capacity.contacts,
        inputs=[model.friction, first, c.n, c.record, c.graph, work.mobility, work.dt, x0],
        outputs=[c.constraint, c.impulse],
    )


def _find_strikes(model: Model, work: Work) -> None:
    """Set which contacts strike if they meet in this step, where bodies have restitution."""
    r, c = work.rebound, work.contacts
    if r:
        launch_over(
            strike.find_strikes,
            work.capacity.contacts,
            inputs=[model.restitution, model.g, work.dt, c.n, c.record, r.before, r.free],
            outputs=[c.constraint, r.strike],
        )


def _sweep(model: Model, v: wp.array, work: Work) -> None:
    c, s = work.contacts, work.sweeps
    launch_over(
        kernels.solve_contacts,
        work.capacity.contacts,
        inputs=[_limits(), work.dt, c.n, c.record, c.constraint, s.changed, v],
        outputs=[c.impulse, s.busy, c.part, s.served, work.worlds],
    )
    launch_over(
        kernels.apply_sweep,
        model.n_vert,
        inputs=[work.worlds, work.dt, c.graph, c.part, work.mobility, s.served],
        outputs=[v, work.forces.received, s.changed],
    )


def _limits() -> kernels.Limits:
    limits = kernels.Limits()
    limits.extrapolation = 1.0 if on("extrapolation") else 0.0
    limits.tolerance, limits.sweeps = IMPULSE_TOLERANCE, SWEEPS
    return limits
