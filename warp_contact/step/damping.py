"""Stage 1 of bodies with damping."""

import warp as wp

from warp_contact.data.damping import Damping
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.motion import damping as kernels
from warp_contact.kernels.motion import motion
from warp_contact.step.forces import apply_damping, internal_forces


def kick_damped(model: Model, state: State, work: Work, stages: int) -> None:
    """Add forces, weight and damping over ``work.dt`` to ``state.v``; ``work.x`` = x + h v."""
    d, inv_mass = work.damping, work.awake.inv_mass
    contacts = [d.last, d.before]
    internal_forces(model, state.x, work.awake.tets, work.f_tet)
    forces = [model.vt_start, model.vt_corner, work.f_tet, inv_mass, model.g]
    if d.undamped is not None:
        inputs = [*forces, work.dt, state.x, state.v]
        wp.launch(motion.kick, model.n_vert, inputs=inputs, outputs=[work.x, d.kicked])
    inputs = [*forces, work.dt, *contacts]
    wp.launch(kernels.load, model.n_vert, inputs=inputs, outputs=[d.even])
    damp(model, state.x, state.v, work, stages)
    wp.launch(
        kernels.finish,
        dim=model.n_vert,
        inputs=[work.dt, *contacts, inv_mass, state.x],
        outputs=[state.v, d.free, work.x],
    )
    if d.undamped is not None:
        inputs = [d.undamped, d.kicked, work.dt, state.x]
        wp.launch(kernels.leave_undamped, model.n_vert, inputs=inputs, outputs=[state.v, work.x])


def damp_alone(model: Model, state: State, work: Work, stages: int) -> None:
    """Let the damping act on ``state.v`` for ``work.dt``, without forces."""
    work.damping.even.zero_()
    damp(model, state.x, state.v, work, stages)


def damp(model: Model, x: wp.array, v: wp.array, work: Work, stages: int) -> None:
    """Add phi(h L) (b - h L v) to ``v`` [m/s], for b [m/s] in ``work.damping.even``."""
    d, inv_mass = work.damping, work.awake.inv_mass
    at_vertex = [model.vt_start, model.vt_corner, work.f_tet, inv_mass, work.dt]
    if not all(e.damped for e in model.elements):
        work.f_tet.zero_()
    apply_damping(model, x, v, work.f_tet)
    wp.launch(kernels.begin, model.n_vert, inputs=[*at_vertex, d.row, d.coef], outputs=[d.even, v])
    last, r = d.even, d.odd
    for k in range(1, stages):
        apply_damping(model, x, last, work.f_tet)
        inputs = [k, *at_vertex, d.row, d.reach, d.coef, last]
        wp.launch(kernels.go_on, model.n_vert, inputs=inputs, outputs=[r, v])
        last, r = r, last


def remember_contacts(model: Model, state: State, d: Damping) -> None:
    """Keep how contacts changed the velocities in this step."""
    inputs = [state.v, d.free]
    wp.launch(kernels.remember, model.n_vert, inputs=inputs, outputs=[d.last, d.before])


def scale_contacts(d: Damping, by: wp.array) -> None:
    """Expect of contacts what they do in steps ``by`` times as long as the last, (n_vert,)."""
    wp.launch(kernels.scale, len(by), inputs=[by], outputs=[d.last, d.before])
