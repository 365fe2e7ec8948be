"""Impulses and displacements of contacts where some bodies take implicit steps."""

from collections.abc import Callable

import warp as wp

from warp_contact.data.implicit import ImplicitWork
from warp_contact.data.launch import launch_over
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.switches import on
from warp_contact.data.work import Work
from warp_contact.kernels.implicit import mobility
from warp_contact.kernels.impulse import coupled as kernels
from warp_contact.kernels.impulse import rows, touched
from warp_contact.kernels.impulse.impulse import Limits
from warp_contact.kernels.surface import coupled_closure as closure
from warp_contact.kernels.surface import coupled_spin as spin
from warp_contact.step import sweeps, ties
from warp_contact.step.implicit import place

TOLERANCE = 1e-4  # of an edge: an approach in a step that needs another sweep
FINER = 1e-5  # the same where bodies are strained, and move anew in each step: else they creep
SWEEPS = 100  # at most: a heavy body on a light one needs most
PASSES = 40  # at most


def begin(model: Model, work: Work) -> None:
    """Set the row sums in ``work.mobility`` over all contacts."""
    w, c = work.implicit, work.contacts
    inputs = [model.body_vert, c.graph]
    launch_over(rows.list_touched, model.n_body, inputs=inputs, outputs=[w.touched])
    launch_over(rows.count_all, work.capacity.contacts, inputs=[c.n], outputs=[w.counted])
    _find_rows(model, work)
    if work.ties:
        ties.find_rows(work)


def apply(model: Model, v: wp.array, work: Work) -> None:
    """Add the parts of the contacts to ``v``, and to the impulses of the frame."""
    if work.ties:
        wp.copy(work.implicit.before, v)
    _collect(model, work, work.implicit.every)
    _record(model, work)
    _add(model, v, v, work)
    if work.ties:
        ties.settle(model, v, work, keeps=True)


def add_parts(model: Model, y: wp.array, work: Work, moves: wp.array) -> None:
    """Add the parts of the contacts to ``y``, in worlds where ``moves`` is not 0."""
    _collect(model, work, moves)
    _add(model, y, y, work)


def sweep_all(
    model: Model,
    v: wp.array,
    work: Work,
    look: int,
    extrapolation: float,
    tolerance: float,
) -> None:
    """Change ``v`` by normal impulses and friction until no contact approaches."""
    w, c = work.implicit, work.contacts
    inputs = [c.n, c.record, c.constraint, c.impulse, v]
    launch_over(kernels.find_counted, work.capacity.contacts, inputs=inputs, outputs=[w.counted])
    limits = Limits()
    limits.extrapolation, limits.tolerance, limits.sweeps = extrapolation, tolerance, SWEEPS
    _repeat(model, v, work, look, _solve_contacts, limits)
    _record(model, work)
    if work.ties:
        ties.settle(model, v, work, keeps=True)


def close(model: Model, state: State, work: Work, look: int) -> None:
    """Move ``state.x`` until no contact overlaps; ``state.v`` keeps the angular momentum."""
    x = state.x
    place(model, x, work.implicit)  # bodies turn about where they are now
    if on("closure torque"):
        _find_spin(model, state, work)
    if work.ties:
        ties.begin_closure(x, work)
    w, c = work.implicit, work.contacts
    inputs = [c.n, c.record, work.surface.slack, x]
    outputs = [w.ahead, w.counted]
    launch_over(closure.begin_pushes, work.capacity.contacts, inputs=inputs, outputs=outputs)
    _repeat(model, x, work, look, _solve_gaps)
    if work.ties:
        ties.close(model, x, work)
    if on("closure torque"):
        _keep_spin(model, state, work)


def _find_spin(model: Model, state: State, work: Work) -> None:
    w = work.implicit
    outputs = [w.bodies, w.kept, w.spin]
    wp.launch(spin.find_spin, model.n_body, inputs=[state.x, state.v], outputs=outputs)


def _keep_spin(model: Model, state: State, work: Work) -> None:
    """Let bodies turn so that the closure has changed no angular momentum."""
    w, c = work.implicit, work.contacts
    place(model, state.x, w)
    inputs = [c.n, c.record, state.v, w.bodies, w.kept]
    outputs = [work.surface.push, c.part]
    launch_over(spin.lost_spin, work.capacity.contacts, inputs=inputs, outputs=outputs)
    if work.ties:
        ties.give_back(model, work)
    inputs = [c.graph, c.part, w.touched, w.busy, state.x, state.v, w.bodies, w.spin]
    wp.launch(spin.find_rotation, model.n_body, inputs=inputs, outputs=[w.kept])
    inputs = [w.busy, w.bodies, w.kept]
    wp.launch(spin.turn_back, model.n_vert, inputs=inputs, outputs=[state.x, state.v])


def _repeat(model: Model, y: wp.array, work: Work, look: int, solve: Callable, *given) -> None:
    """Change ``y`` in sweeps of touched vertices, then all by the sum of the impulses."""
    w = work.implicit
    wp.copy(w.before, y)
    w.impulse.zero_()
    if work.ties:
        work.ties.ties.since.zero_()
    _find_rows(model, work)
    if work.ties:
        ties.set_rows(work)
    sweeps.repeat(work, look, True, _sweep, model, y, work, solve, *given)
    _add(model, w.before, y, work)


def _sweep(model: Model, y: wp.array, work: Work, solve: Callable, *given) -> None:
    w, c, s = work.implicit, work.contacts, work.sweeps
    solve(y, work, *given)
    launch_over(
        touched.respond,
        model.n_body,
        inputs=[work.worlds, c.graph, c.record, w.counted, c.part, s.served, w.touched, w.x]
        + [w.bodies],
        outputs=[w.busy, w.by, w.y, w.share, w.impulse],
    )
    launch_over(
        touched.move,
        model.n_vert,
        inputs=[work.worlds, work.dt, c.graph, w.touched, w.x, w.y, w.share, w.busy, w.by]
        + [w.bodies],
        outputs=[y, work.mobility.row, s.changed],
    )
    if work.ties:
        ties.relax(model, y, work)


def _solve_contacts(v: wp.array, work: Work, limits: Limits) -> None:
    w, c, s = work.implicit, work.contacts, work.sweeps
    launch_over(
        kernels.solve_contacts,
        work.capacity.contacts,
        inputs=[limits, work.dt, c.n, c.record, c.constraint, work.mobility.row, s.changed, v],
        outputs=[c.impulse, s.busy, w.counted, c.part, s.served, work.worlds],
    )


def _solve_gaps(x: wp.array, work: Work) -> None:
    w, c, s = work.implicit, work.contacts, work.surface
    launch_over(
        closure.solve_gaps,
        work.capacity.contacts,
        inputs=[PASSES, c.n, c.record, c.constraint, s.slack, work.mobility.row, x],
        outputs=[s.push, w.ahead, w.counted, c.part, work.sweeps.served, work.worlds],
    )


def _find_rows(model: Model, work: Work) -> None:
    """Set the row sums of the contacts that count."""
    w, c, s = work.implicit, work.contacts, work.sweeps
    inputs = [c.graph, c.record, w.counted]
    outputs = [w.share, s.served, s.changed]
    launch_over(rows.find_shares, model.n_vert, inputs=inputs, outputs=outputs)
    inputs = [c.graph, w.touched, w.share, w.x, w.bodies]
    launch_over(rows.find_rows, model.n_vert, inputs=inputs, outputs=[work.mobility.row])


def answer(model: Model, p: wp.array, out: wp.array, w: ImplicitWork) -> None:
    """Set ``out`` to what impulses ``p`` at vertices with contacts change, shape (n_vert,)."""
    d, n_body = w.bodies, model.n_body
    inputs, outputs = [p, w.touched, w.x, d], [w.busy, w.by, w.y]
    launch_over(touched.gather, n_body, inputs=inputs, outputs=outputs)
    inputs = [w.y, w.touched, d, w.busy]
    wp.launch(touched.multiply, model.n_vert, inputs=inputs, outputs=[out])
    wp.launch(mobility.correct, n_body, inputs=[w.x, d, w.by, w.busy], outputs=[w.of, out])


def _collect(model: Model, work: Work, moves: wp.array) -> None:
    w, c = work.implicit, work.contacts
    w.impulse.zero_()
    inputs = [c.graph, c.part, work.worlds, moves]
    launch_over(kernels.collect, model.n_vert, inputs=inputs, outputs=[w.impulse])


def _record(model: Model, work: Work) -> None:
    inputs = [work.contacts.graph, work.implicit.impulse]
    for sums in work.forces.received, work.implicit.total:
        launch_over(kernels.record, model.n_vert, inputs=inputs, outputs=[sums])


def _add(model: Model, before: wp.array, y: wp.array, work: Work) -> None:
    """Set ``y`` = ``before`` and what the impulses change."""
    w = work.implicit
    answer(model, w.impulse, w.answer, w)
    inputs = [before, w.impulse, w.answer, w.bodies]
    wp.launch(kernels.add, model.n_vert, inputs=inputs, outputs=[y])
