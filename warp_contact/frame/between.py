"""What is read and set between two frames, where velocities are half a step behind positions."""

from collections.abc import Callable

import numpy as np
import warp as wp

from warp_contact.data import damping
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work, everything
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce
from warp_contact.step.velocity import answer_of, shift_velocities, velocities_now

ROUNDS = 24  # of halving what is left of a velocity
ROUNDING = 1e-7  # of the largest velocity: less is not left


def velocities(
    model: Model,
    state: State,
    work: Work,
    dt: np.ndarray,
    response: ContactSurface | Penalty | PredictedForce,
    apart: np.ndarray,
) -> np.ndarray:
    """Velocities [m/s] at the time of the positions, shape (n_vert, 3).

    ``dt`` is the last step of each vertex [s]; those ``apart``, a mask, are of worlds where nothing
    overlaps. Contacts answer differently there, so that they are found for each kind of world.
    """
    out = np.empty((model.n_vert, 3), dtype=np.float32)
    for one in np.unique(apart).tolist():
        now = velocities_now(model, state, work, dt, answer_of(response, one)).numpy()
        out[apart == one] = now[apart == one]
    return out


def set_velocities(
    model: Model, state: State, work: Work, dt: np.ndarray, values: np.ndarray, at: np.ndarray
) -> None:
    """Set velocities ``values`` [m/s] at that time, shape (k, 3), of the vertices ``at`` (k,).

    ``dt`` is the last step of each vertex [s], shape (n_vert,).
    """
    v = state.v.numpy().copy()
    if not work.implicit:
        gained = State(state.x, wp.zeros(model.n_vert, dtype=wp.vec3))
        shift_velocities(model, gained, work, everything(model), -0.5 * dt)
        v[at] = values + gained.v.numpy()[at]
        return state.v.assign(v)
    v[at] = values
    awake = everything(work.implicit.explicit or model)
    for _ in range(ROUNDS):  # what half a step adds depends on the velocity, by less than itself
        now = State(state.x, wp.array(v, dtype=wp.vec3))
        shift_velocities(model, now, work, awake, 0.5 * dt)
        left = values - now.v.numpy()[at]
        v[at] += left
        if np.abs(left).max(initial=0.0) <= ROUNDING * np.abs(v).max():
            break
    state.v.assign(v)


def change_gravity(
    model: Model, state: State, work: Work, dt: np.ndarray, change: Callable[[], None]
) -> None:
    """Let gravity ``change`` at that time: half of the last step ``dt`` [s] (n_vert,) was before.

    Velocities there stay as they are.
    """
    moving = np.flatnonzero(model.inv_mass.numpy() > 0.0)
    now = State(state.x, wp.clone(state.v))
    awake = everything(work.implicit.explicit or model if work.implicit else model)
    shift_velocities(model, now, work, awake, 0.5 * dt)
    change()
    if dt.any():
        set_velocities(model, state, work, dt, now.v.numpy()[moving], moving)


def set_positions(
    model: Model, state: State, work: Work, dt: np.ndarray, x: np.ndarray, v: np.ndarray
) -> None:
    """Set positions ``x`` [m] where velocities at that time are ``v`` [m/s]; all (n_vert, 3).

    Damping expects no more of contacts what they did to these bodies before.
    """
    body = model.vert_body.numpy()
    moved = np.isin(body, body[(x != state.x.numpy()).any(axis=1)])
    state.x.assign(x)
    damping.forget_at(work.damping, moved)
    set_velocities(model, state, work, dt, v[moved], np.flatnonzero(moved))
