"""The steps of implicit bodies: prediction, answer to impulses, drift.

Where no body takes implicit steps nothing of this runs.
"""

import warp as wp

from warp_contact.data.implicit import ImplicitWork
from warp_contact.data.launch import while_any
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.implicit import advance as drifting
from warp_contact.kernels.implicit import bodies, masses, mobility, predict, solve
from warp_contact.step.forces import apply_damping, apply_stiffness, internal_forces


def kick(model: Model, state: State, work: Work) -> None:
    """Let forces, weight and damping act on ``state.v`` for ``work.dt``, a step or part of one."""
    w = work.implicit
    if w.any_deforming:
        find_mobility(model, state.x, w)
        _find_forces(model, state, work)
        _find_load(model, state, w, work.warm.lacking)
        solve_present(model, state.x, work)
    else:
        place(model, state.x, w)
        rigid_part(model, w.dv, state.x, w)  # of nothing
    inputs = [state.x, w.dv, model.g, work.dt, w.bodies, w.of]
    wp.launch(predict.kick, model.n_vert, inputs=inputs, outputs=[state.v])
    wp.copy(w.predicted, state.v)
    w.total.zero_()


def multiply_change(model: Model, state: State, w: ImplicitWork) -> None:
    """Set ``ap`` = A y, where y is what the contacts changed of ``state.v`` in this step."""
    inputs = [w.bodies, state.v, w.predicted]
    wp.launch(predict.difference, model.n_vert, inputs=inputs, outputs=[w.p])
    _multiply(model, state.x, w.p, w.ap, w, w.every)


def solve_present(model: Model, x: wp.array, work: Work) -> None:
    """Set ``dv`` = A^-1 ``r``, and ``of`` to its rigid part; ``r`` becomes what is left of it."""
    w = work.implicit
    w.dv.zero_()
    w.running.zero_()
    answer(model, w.r, w.z, w)
    inputs = [w.r, w.z, w.bodies, x]
    outputs = [w.iteration, w.p, w.running]
    wp.launch(solve.begin, model.n_body, inputs=inputs, outputs=outputs)
    while_any(w.running, _iterate, model, x, w)
    rigid_part(model, w.dv, x, w)


def push(model: Model, state: State, work: Work, part: float) -> None:
    """Let forces and torques from outside act on ``state.v`` for a ``part`` of ``work.dt``."""
    w = work.implicit
    place(model, state.x, w)
    inputs = [state.x, work.dt, part, w.bodies]
    wp.launch(predict.push, model.n_vert, inputs=inputs, outputs=[state.v])


def drift(model: Model, state: State, work: Work, out: wp.array, turned: bool = False) -> None:
    """Set ``out`` to x after ``work.dt``; with ``turned``, ``state.v`` to the velocities there."""
    w = work.implicit
    rigid_part(model, state.v, state.x, w)
    given = [work.dt, state.x]
    inputs = [*given, state.v, w.bodies, w.of]
    wp.launch(drifting.find_drift, model.n_body, inputs=inputs, outputs=[w.drift])
    inputs = [*given, w.bodies, w.of, w.drift, turned]
    wp.launch(drifting.advance, model.n_vert, inputs=inputs, outputs=[state.v, out])


def place(model: Model, x: wp.array, w: ImplicitWork) -> None:
    """Let the rigid part of the mobilities be that at ``x``."""
    wp.copy(w.x, x)
    wp.launch(masses.find_bodies, model.n_body, inputs=[x], outputs=[w.bodies])


def find_mobility(model: Model, x: wp.array, w: ImplicitWork) -> None:
    """Let the mobilities be those at ``x``."""
    place(model, x, w)
    d = w.bodies
    inputs = [model.tets, model.pose, model.volume, x, d]
    wp.launch(bodies.find_gradients, model.n_tet, inputs=inputs, outputs=[w.gradient])
    inputs = [model.vt_start, model.vt_corner, w.gradient]
    wp.launch(bodies.find_turns, model.n_vert, inputs=inputs, outputs=[d])


def answer(
    model: Model, p: wp.array, out: wp.array, w: ImplicitWork, chosen: wp.array | None = None
) -> None:
    """Set ``out`` = G p for impulses ``p``, shape (n_vert,); 0 for bodies without any.

    Only of the bodies where ``chosen``, shape (n_body,), is not 0; 0 for the others too.
    """
    d, n_body, x = w.bodies, model.n_body, w.x
    inputs = [p, x, d, w.every if chosen is None else chosen]
    outputs = [w.by, w.rest, w.busy, w.y]
    wp.launch(mobility.to_rest, n_body, inputs=inputs, outputs=outputs)
    wp.launch(mobility.multiply, model.n_vert, inputs=[w.y, d, w.rest, w.busy], outputs=[out])
    wp.launch(mobility.correct, n_body, inputs=[x, d, w.by, w.busy], outputs=[w.of, out])


def rigid_part(model: Model, y: wp.array, x: wp.array, w: ImplicitWork) -> None:
    """Set ``of`` for velocities ``y`` at ``x``."""
    wp.launch(mobility.rigid_part, model.n_body, inputs=[y, x, w.bodies], outputs=[w.of])


def _find_forces(model: Model, state: State, work: Work) -> None:
    """Set ``f`` - C v."""
    w = work.implicit
    internal_forces(model, state.x, work.awake.tets, work.f_tet)
    _apply_damping(model, state.x, state.v, w)
    inputs = [model.vt_start, model.vt_corner, work.f_tet, w.damped, w.bodies]
    wp.launch(predict.sum_forces, model.n_vert, inputs=inputs, outputs=[w.f])


def _find_load(model: Model, state: State, w: ImplicitWork, lacking: wp.array) -> None:
    """Set the right-hand side ``r``."""
    d, n, x, v = w.bodies, model.n_vert, state.x, state.v
    of_fixed = w.none
    if w.any_held:
        wp.launch(predict.at_fixed, n, inputs=[d, v], outputs=[w.p])
        _multiply(model, x, w.p, w.ap, w, w.every)
        of_fixed = w.ap
    wp.launch(predict.momenta, n, inputs=[d, v, of_fixed], outputs=[w.r])
    answer(model, w.r, w.z, w)
    wp.launch(predict.difference, n, inputs=[d, v, w.z], outputs=[w.p])
    apply_stiffness(model, x, w.p, w.stiff)
    at_vertex = [model.vt_start, model.vt_corner, w.stiff]
    inputs = [*at_vertex, w.f, lacking, model.g, d]
    wp.launch(predict.load, n, inputs=inputs, outputs=[w.r])
    wp.launch(mobility.rigid_response, model.n_body, inputs=[w.r, x, d], outputs=[w.by])
    wp.launch(predict.remove_rigid, n, inputs=[x, d, w.by], outputs=[w.r])


def _iterate(model: Model, x: wp.array, w: ImplicitWork) -> None:
    n_body, it = model.n_body, w.iteration
    _multiply(model, x, w.p, w.ap, w, it.going)
    wp.launch(solve.go, n_body, inputs=[w.p, w.ap, w.bodies], outputs=[it, w.dv, w.r])
    answer(model, w.r, w.z, w, it.going)
    outputs = [it, w.p, w.dv, w.running]
    wp.launch(solve.look, n_body, inputs=[w.r, w.z, w.bodies], outputs=outputs)


def _multiply(
    model: Model, x: wp.array, p: wp.array, out: wp.array, w: ImplicitWork, chosen: wp.array
) -> None:
    """Set ``out`` = A(x) p of bodies that are ``chosen``; ``p`` is 0 in the others."""
    apply_stiffness(model, x, p, w.stiff)
    _apply_damping(model, x, p, w)
    inputs = [model.vt_start, model.vt_corner, w.stiff, w.damped, w.bodies, chosen, p]
    wp.launch(solve.multiply, model.n_vert, inputs=inputs, outputs=[out])


def _apply_damping(model: Model, x: wp.array, v: wp.array, w: ImplicitWork) -> None:
    if w.damped.shape[0] == 0:
        return
    if not all(e.damped for e in model.elements):
        w.damped.zero_()
    apply_damping(model, x, v, w.damped)
