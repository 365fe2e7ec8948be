"""One step of the responses that the default is compared with.

Overlaps may be left by any of them: bodies are never known to be apart when a step begins.
"""

import warp as wp

from warp_contact.data.launch import if_any, launch_over
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.impulse import penalty, predicted, virtual
from warp_contact.step import broad_phase, impulse, motors, residual, search
from warp_contact.step.damping import damp_alone
from warp_contact.step.detection import detect, detect_vertices
from warp_contact.step.motion import explicit_part, finish, kick, predict
from warp_contact.step.response import Penalty, VirtualSurface


def step_literal(
    model: Model, state: State, work: Work, damping_stages: int, iterations: int
) -> None:
    """The order and the bisection of the paper: displacement first, then velocities."""
    work.worlds.apart.zero_()
    predict(model, state, work, damping_stages)
    broad_phase.refresh(model, state.x, work.x, work)
    wp.copy(state.x, work.x)
    detect_vertices(model, state.x, state.x, work)
    residual.find_gaps(model, state.x, work)
    if_any(work.surface.any_open, search.bisect, model, state.x, work, iterations)
    if_any(work.contacts.n, impulse.exchange, model, state.v, work)
    impulse.add_forces(state.x, work)


def step_penalty(
    model: Model, state: State, work: Work, damping_stages: int, response: Penalty
) -> None:
    """Penalty forces, at the positions at the start of the step.

    They are no impulses that answer to a load, so that none can be expected of the next step, and
    the damping acts alone, before all forces: the state at rest must not depend on it.
    """
    work.worlds.apart.zero_()
    if damping_stages > 0:
        damp_alone(explicit_part(model, work), state, work, damping_stages)
    kick(model, state, work, work.awake)
    if work.ties and work.ties.driven:
        motors.drive(model, state, work)
    broad_phase.refresh(model, state.x, state.x, work)
    detect(model, state.x, state.x, work)
    if_any(work.contacts.n, _push, model, state, work, response)
    impulse.add_forces(state.x, work)
    finish(model, state, work)


def step_predicted(model: Model, state: State, work: Work, damping_stages: int) -> None:
    """Forces that close the gaps predicted for the end of the step; overlaps may last."""
    work.worlds.apart.zero_()
    predict(model, state, work, damping_stages)
    broad_phase.refresh(model, state.x, work.x, work)
    detect(model, state.x, work.x, work)
    if_any(work.contacts.n, _push_apart, model, state, work)
    impulse.add_forces(state.x, work)
    finish(model, state, work)


def push_half_step(model: Model, now: State, work: Work, response: Penalty) -> None:
    """Add what the penalty forces at ``now.x`` add to ``now.v`` in half a step."""
    work.worlds.apart.zero_()
    detect(model, now.x, now.x, work)
    if_any(work.contacts.n, _push, model, now, work, response)


def _push(model: Model, state: State, work: Work, response: Penalty) -> None:
    """Change ``state.v`` by the penalty forces at the depths found."""
    c = work.contacts
    spring = wp.vec2(response.stiffness, response.damping)
    given = [work.dt, c.n, c.record, c.constraint, state.v]
    kernel, inputs = penalty.penalty_impulses, [spring, model.friction, *given]
    if isinstance(response, VirtualSurface):
        kernel, inputs = virtual.virtual_impulses, [spring, *given, work.mesh, state.x]
    launch_over(kernel, work.capacity.contacts, inputs=inputs, outputs=[c.impulse, c.part])
    impulse.apply(model, state.v, work)


def _push_apart(model: Model, state: State, work: Work) -> None:
    """Change ``state.v`` by the forces that close the gaps at ``work.x``."""
    c = work.contacts
    launch_over(
        predicted.predicted_impulses,
        work.capacity.contacts,
        inputs=[model.friction, work.dt, c.n, c.record, c.constraint, work.x, state.v],
        outputs=[c.impulse, c.part],
    )
    impulse.apply(model, state.v, work)
