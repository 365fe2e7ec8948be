"""The motion of the vertices without contact: damping, forces, drift."""

import warp as wp

from warp_contact.data.model import Model
from warp_contact.data.state import Awake, State
from warp_contact.data.work import Work
from warp_contact.kernels.motion import motion
from warp_contact.step import implicit, motors, rebound, ties
from warp_contact.step.damping import kick_damped
from warp_contact.step.forces import internal_forces


def predict(model: Model, state: State, work: Work, damping_stages: int) -> None:
    """Let forces, weight and damping act on ``state.v`` for a step; set ``work.x`` = x + h v."""
    if work.rebound:
        wp.copy(work.rebound.before, state.v)
    kick(model, state, work, work.awake, damping_stages)
    if work.ties:
        hold = motors.drive if work.ties.driven else ties.hold
        hold(model, state, work)
        implicit.drift(model, state, work, work.x)
    if work.rebound:
        wp.copy(work.rebound.free, state.v)


def kick(model: Model, state: State, work: Work, awake: Awake, damping_stages: int = 0) -> None:
    """Let forces and weight act on ``state.v`` for ``work.dt``, and set ``work.x`` = x + h v.

    Explicit steps are damped in so many stages, implicit ones by their own damping.
    """
    explicit = explicit_part(model, work)
    if explicit and damping_stages > 0:
        kick_damped(explicit, state, work, damping_stages)
    elif explicit:
        _kick_undamped(explicit, state, work, awake)
    if work.implicit:
        implicit.kick(work.implicit.deforming, state, work)
        if work.ties:
            ties.begin(state.x, work)
        implicit.drift(model, state, work, work.x)


def explicit_part(model: Model, work: Work) -> Model | None:
    """The model with the tets of bodies that take explicit steps alone; None where none does."""
    return work.implicit.explicit if work.implicit else model


def _kick_undamped(model: Model, state: State, work: Work, awake: Awake) -> None:
    internal_forces(model, state.x, awake.tets, work.f_tet)
    wp.launch(
        motion.kick,
        dim=model.n_vert,
        inputs=[model.vt_start, model.vt_corner, work.f_tet, awake.inv_mass]
        + [model.g, work.dt, state.x, state.v],
        outputs=[work.x, state.v],
    )


def drift(model: Model, state: State, work: Work, out: wp.array) -> None:
    """Set ``out`` to where ``state.v`` leads: x + h v, or along the rotation of a body."""
    if work.implicit:
        return implicit.drift(model, state, work, out)
    wp.launch(motion.advance, dim=model.n_vert, inputs=[work.dt, state.x, state.v], outputs=[out])


def finish(model: Model, state: State, work: Work, apart: bool = False) -> None:
    """Move ``state.x`` by ``state.v``, to the end of the step; ``apart`` if nothing touched."""
    if work.ties:
        ties.hold(model, state, work)  # what contacts have moved
        ties.make_up(model, state, work, apart)
        if work.ties.driven:
            motors.finish(model, state, work)
    bounces = work.rebound and not apart
    if bounces:
        rebound.weigh(state.v, work)
    if work.implicit:
        implicit.drift(model, state, work, state.x, turned=True)
    else:
        drift(model, state, work, state.x)
    if bounces:
        rebound.part(model, state, work)
    if work.ties:
        ties.record(model, state.x, work)


def finish_free(model: Model, state: State, work: Work) -> None:
    """The same where nothing touched: ``work.x`` is the end of the step."""
    if work.ties:
        return finish(model, state, work, apart=True)
    if work.implicit:
        return implicit.drift(model, state, work, state.x, turned=True)
    wp.copy(state.x, work.x)
