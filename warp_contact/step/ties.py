"""Attachments within a step. Where there are none, nothing of this runs."""

import warp as wp

from warp_contact.data.launch import launch_over
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.impulse import coupled
from warp_contact.kernels.ties import attachment, closure, lacking, matrix, motor, rows, solve
from warp_contact.step import implicit

ROUNDS = 2  # of the ties in a step, as many after the contacts


def begin_frame(work: Work) -> None:
    """Forget the forces of the last frame."""
    t = work.ties
    inputs = [work.awake.bodies]
    wp.launch(attachment.begin_frame, t.n_attachment, inputs=inputs, outputs=[t.attachments])
    if len(t.motors.which):
        inputs = [work.awake.bodies, t.attachments]
        wp.launch(motor.begin_frame, t.n_attachment, inputs=inputs, outputs=[t.motors])


def begin(x: wp.array, work: Work) -> None:
    """Begin a step of ``work.dt`` at ``x``, or a part of one; where mobilities are those there."""
    t, d = work.ties, work.implicit.bodies
    wp.launch(matrix.begin_ties, t.n, inputs=[work.dt, x, d], outputs=[t.ties])
    find_matrix(x, work)


def begin_closure(x: wp.array, work: Work) -> None:
    """Let matrix and row sums be those at ``x``, where the mobilities are now.

    With those of another place sweeps over bodies that turned far do not end.
    """
    find_matrix(x, work)
    find_rows(work)


def hold(model: Model, state: State, work: Work) -> None:
    """Change ``state.v`` so that ties are closed at the end of the step."""
    t = work.ties
    for _ in range(ROUNDS):
        implicit.drift(model, state, work, work.x)
        wp.launch(solve.find_gaps, t.n, inputs=[work.dt, work.x], outputs=[t.ties])
        _pull(model, state.v, work, keeps=True)
    wp.launch(solve.settled, t.n_cluster, inputs=[], outputs=[t.ties])


def hold_still(model: Model, state: State, work: Work) -> None:
    """Change ``state.v`` so that no tie opens at ``state.x``; springs act for ``work.dt``."""
    t = work.ties
    for _ in range(ROUNDS):
        inputs = [work.dt, state.x, state.v]
        wp.launch(solve.find_speeds, t.n, inputs=inputs, outputs=[t.ties])
        _pull(model, state.v, work, keeps=True)


def relax(model: Model, y: wp.array, work: Work) -> None:
    """Within the sweeps over contacts: take from ``y`` what opened ties since ``before``.

    Only vertices with contacts or ties move.
    """
    t, w, c = work.ties, work.implicit, work.contacts
    given = [w.touched, t.tied, w.x, w.y, w.busy, w.by, w.bodies]
    wp.launch(solve.follow, t.n_vert, inputs=[c.graph, *given], outputs=[y])
    inputs = [True, work.worlds, w.before, y]
    wp.launch(solve.find_changes, t.n, inputs=inputs, outputs=[t.ties])
    _solve(work, keeps=False)
    wp.launch(solve.gather, model.n_body, inputs=[w.x, w.bodies], outputs=[t.tied])
    inputs = [work.worlds, work.dt, c.graph, t.tied, w.x, w.bodies]
    launch_over(solve.move, model.n_vert, inputs=inputs, outputs=[y, work.sweeps.changed])
    set_rows(work)


def make_up(model: Model, state: State, work: Work, apart: bool) -> None:
    """Set what the next step makes up for of what bodies lacked; before the drift."""
    w = work.implicit
    implicit.multiply_change(w.deforming, state, w)
    inputs = [w.bodies, w.total, w.ap, work.ties.attached, apart]
    wp.launch(lacking.make_up, model.n_body, inputs=inputs, outputs=[work.warm.lacking])


def find_rows(work: Work) -> None:
    """Set the row sums of contacts on bodies that hang together, and what they are made of."""
    t, w = work.ties, work.implicit
    inputs = [w.touched, w.bodies]
    launch_over(rows.list_slots, t.n_cluster, inputs=inputs, outputs=[t.rows])
    n, inputs = t.rows.cluster.shape[0], [t.ties, w.x, w.bodies]
    if n:
        launch_over(rows.find_columns, n, inputs=inputs, outputs=[t.rows])
        launch_over(rows.find_norms, n, inputs=inputs, outputs=[t.rows])
    set_rows(work)


def set_rows(work: Work) -> None:
    """Set the row sums for the contacts that count."""
    t, w = work.ties, work.implicit
    n, inputs = t.rows.cluster.shape[0], [w.share, t.rows, w.bodies]
    if n:
        launch_over(rows.set_rows, n, inputs=inputs, outputs=[work.mobility.row])


def settle(model: Model, y: wp.array, work: Work, keeps: bool) -> None:
    """Take from ``y`` what opened ties since ``before``; ``keeps`` where it is of the step."""
    t, w = work.ties, work.implicit
    t.ties.since.zero_()
    for _ in range(ROUNDS):
        inputs = [False, work.worlds, w.before, y]
        wp.launch(solve.find_changes, t.n, inputs=inputs, outputs=[t.ties])
        _pull(model, y, work, keeps)


def close(model: Model, x: wp.array, work: Work) -> None:
    """Close at ``x`` what the closure of contacts opened; set ``busy`` where both moved a body."""
    t, w = work.ties, work.implicit
    settle(model, x, work, keeps=False)
    for _ in range(ROUNDS):
        _find_moved(model, work)
        implicit.place(model, x, w)
        wp.launch(closure.restore, model.n_vert, inputs=[w.busy, t.tied, w.bodies], outputs=[x])
        wp.launch(closure.find_left, t.n, inputs=[x], outputs=[t.ties])
        _pull(model, x, work, keeps=False)
    _find_moved(model, work)
    wp.launch(solve.settled, t.n_cluster, inputs=[], outputs=[t.ties])


def look_again(work: Work) -> None:
    """Let the second look of the closure run in all worlds with attachments.

    These pass impulses on, and so lead corners in that had no contact.
    """
    inputs, outputs = [work.ties.ties], [work.worlds]
    wp.launch(closure.look_again, work.ties.n, inputs=inputs, outputs=outputs)


def give_back(model: Model, work: Work) -> None:
    """Add to the angular momenta ``spin`` what ties took of them in the closure."""
    t, w = work.ties, work.implicit
    inputs = [t.ties, t.tied, w.bodies, w.kept]
    wp.launch(closure.give_back, model.n_body, inputs=inputs, outputs=[w.spin])


def _find_moved(model: Model, work: Work) -> None:
    t, w = work.ties, work.implicit
    inputs = [w.impulse, w.touched, t.ties, t.tied, w.bodies]
    wp.launch(closure.find_moved, model.n_body, inputs=inputs, outputs=[w.busy])


def record(model: Model, x: wp.array, work: Work) -> None:
    """Add the forces of the step, which ends at ``x``, to those of the frame; break what breaks."""
    t = work.ties
    inputs = [work.dt, model.body_edge, x, work.worlds.of_vert, t.ties]
    outputs = [t.attachments, work.broad_phase.stale, work.worlds.unsolved]
    wp.launch(attachment.record, t.n_attachment, inputs=inputs, outputs=outputs)


def keep_apart(model: Model, work: Work) -> None:
    """Let no pair of bodies that are attached to each other meet, until pairs are found again."""
    t, b = work.ties, work.broad_phase
    for pairs, edges in ((b.verts, t.no_edges), (b.edges, model.edges)):
        inputs = [model.vert_body, edges, pairs.list, t.partners]
        n, outputs = pairs.clear_until.shape[0], [pairs.clear_until]
        launch_over(attachment.keep_apart, n, inputs=inputs, outputs=outputs)


def wake_attached(mobile: wp.array, awake: wp.array, again: wp.array, work: Work) -> None:
    """Wake what is attached to a body ``awake``, if it is ``mobile``; all as in ``Sleeping``."""
    t = work.ties
    inputs, outputs = [t.attachments, mobile], [awake, again]
    wp.launch(attachment.wake, t.n_attachment, inputs=inputs, outputs=outputs)


def find_matrix(x: wp.array, work: Work) -> None:
    """Let the matrix be that at ``x``, where the mobilities are now."""
    t = work.ties
    wp.launch(matrix.assemble, t.n, inputs=[x, work.implicit.bodies], outputs=[t.ties])
    wp.launch(matrix.factorise, t.n_cluster, inputs=[], outputs=[t.ties])
    wp.launch(matrix.find_singular, t.n_cluster, inputs=[], outputs=[t.ties])


def _pull(model: Model, y: wp.array, work: Work, keeps: bool) -> None:
    """Solve for r, and add how all vertices answer to ``y``."""
    t, w = work.ties, work.implicit
    _solve(work, keeps)
    implicit.answer(model, t.tied.p, w.answer, w)
    inputs = [y, t.tied.p, w.answer, w.bodies]
    wp.launch(coupled.add, model.n_vert, inputs=inputs, outputs=[y])


def _solve(work: Work, keeps: bool) -> None:
    t = work.ties
    wp.launch(solve.solve, t.n_cluster, inputs=[keeps], outputs=[t.ties])
    inputs, outputs = [t.ties, keeps], [t.tied, work.implicit.total]
    wp.launch(solve.spread, t.n_vert, inputs=inputs, outputs=outputs)
