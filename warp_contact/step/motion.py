"""The motion of the vertices without contact: damping, forces, drift."""

import warp as wp

from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.motion import motion
from warp_contact.step.forces import damp, internal_forces


def predict(model: Model, state: State, work: Work, damping_stages: int) -> None:
    """Damp ``state.v`` in so many stages, kick it, set ``work.x`` = x + h v.

    In this order: damping after the kick would pass the load of vertices at rest in a contact on to
    their neighbours before the impulses act, and the state at rest would depend on the damping.
    """
    if damping_stages > 0:
        scratch, inv_mass = (work.v, work.surface.s), work.awake.inv_mass
        damp(
            model,
            state.x,
            state.v,
            inv_mass,
            work.dt,
            work.f_tet,
            scratch,
            damping_stages,
            work.share,
        )
    kick(model, state, work)


def kick(model: Model, state: State, work: Work) -> None:
    """Add the acceleration over ``work.dt`` to ``state.v``, and set ``work.x`` = x + h v."""
    internal_forces(model, state.x, work.awake.tets, work.f_tet)
    wp.launch(
        motion.kick,
        dim=model.n_vert,
        inputs=[model.vt_start, model.vt_corner, work.f_tet, work.awake.inv_mass]
        + [wp.vec3(*model.gravity), work.dt, state.x, state.v],
        outputs=[work.x, state.v],
    )


def drift(model: Model, state: State, work: Work, out: wp.array) -> None:
    """Set ``out`` = x + h v."""
    wp.launch(motion.advance, dim=model.n_vert, inputs=[work.dt, state.x, state.v], outputs=[out])
