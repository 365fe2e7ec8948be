"""Velocities at the time of the positions.

Those of symplectic Euler belong to the middle of a step: ``State.v`` is half a step behind
``State.x``. The other half step brings them to its time, as in velocity Verlet: forces and weight
act, and contacts answer: impulses keep what touches from approaching (Andersen 1983, RATTLE).
"""

from collections.abc import Callable
from functools import partial

import numpy as np
import warp as wp

from warp_contact.data.launch import if_any
from warp_contact.data.model import Model
from warp_contact.data.state import Awake, State
from warp_contact.data.work import Work
from warp_contact.kernels.lengths import REST_GAP
from warp_contact.step import broad_phase, impulse, motors, narrow_phase
from warp_contact.step.detection import detect
from warp_contact.step.motion import kick
from warp_contact.step.other_responses import push_half_step
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce
from warp_contact.step.settle import settle
from warp_contact.step.ties import hold_still


def velocities_now(
    model: Model, state: State, work: Work, dt: np.ndarray, answer: Callable
) -> wp.array:
    """Velocities [m/s] at the time of ``state.x``, shape (n_vert,).

    ``dt`` is the last step of each vertex [s], shape (n_vert,), ``answer`` is that of
    ``answer_of``. The contacts in ``work`` and the forces of the frame change; where they did not
    fit, see ``work.overflow``, the result is none.
    """
    now = State(state.x, wp.clone(state.v))
    if dt.any():
        work.dt.assign((0.5 * dt).astype(np.float32))
        work.overflow.all.zero_()
        kick(model, now, work, work.awake)
        if work.ties and work.ties.driven:
            motors.again(model, now, work)
        if work.ties:
            hold_still(model, now, work)
        if work.rebound:
            wp.copy(work.rebound.before, state.v)
            wp.copy(work.rebound.free, now.v)
        broad_phase.refresh(model, state.x, work.x, work)
        if_any(work.broad_phase.any_pair, answer, model, now, work)
    return now.v


def shift_velocities(
    model: Model, state: State, work: Work, awake: Awake, time: np.ndarray
) -> None:
    """Let ``state.v`` of what is ``awake`` belong to ``time`` [s] later, without contacts.

    ``time`` is that of each vertex, shape (n_vert,).
    """
    if time.any():
        work.dt.assign(time.astype(np.float32))
        kick(model, state, work, awake)


def answer_of(response: ContactSurface | Penalty | PredictedForce, apart: bool) -> Callable:
    """How contacts answer the half step; ``apart`` where nothing overlaps."""
    if isinstance(response, Penalty):
        return partial(push_half_step, response=response)
    return _answer_apart if apart else _answer


# Half a step may be too short to fall through the resting gap in which contacts leave a body: what
# is as close to a plane touches it here. Beside bodies all is taken that is within their margin.


def _answer_apart(model: Model, now: State, work: Work) -> None:
    work.worlds.apart.fill_(1)
    narrow_phase.find_vertices(model, now.x, work.x, work, REST_GAP)
    narrow_phase.continue_edges(model, now.x, work)
    if_any(work.contacts.n, _answer_contacts, model, now, work)


def _answer(model: Model, now: State, work: Work) -> None:
    work.worlds.apart.zero_()
    detect(model, now.x, now.x, work, REST_GAP)
    if_any(work.contacts.n, _answer_contacts, model, now, work)


def _answer_contacts(model: Model, now: State, work: Work) -> None:
    impulse.solve_half_step(model, now, work)
    if work.implicit and work.implicit.any_deforming:
        settle(model, now, work, keeps=False)
