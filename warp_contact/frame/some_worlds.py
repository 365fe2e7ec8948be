"""Some worlds begin anew while the others go on."""

import numpy as np

from warp_contact.data import damping, warm_start
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.frame.last_frame import LastFrame
from warp_contact.frame.stepper import Stepper


def begin_anew(stepper: Stepper, model: Model, state: State, chosen: np.ndarray) -> None:
    """Put the worlds ``chosen``, a mask (n_world,), where they were before the first frame.

    Nothing is left there of later frames, so that the first ones come again.
    """
    of_vert, last = chosen[stepper.worlds.of_vert], stepper.last
    for array, first in zip((state.x, state.v), stepper.first, strict=True):
        now = array.numpy().copy()
        now[of_vert] = first[of_vert]
        array.assign(now)
    of_edge = of_vert[model.edges.numpy()[:, 0]]
    warm_start.forget_at(stepper.work.warm, of_vert, of_edge)
    damping.forget_at(stepper.work.damping, of_vert)
    stepper.spectrum.forget(chosen)
    n, dt = np.where(chosen, 0, last.n), np.where(chosen, 0.0, last.dt)
    overlapping = np.where(chosen, -1, last.overlapping)
    stepper.last = LastFrame(n, dt, overlapping)
    if stepper.sleeping:
        stepper.sleeping.wake_all(chosen, stepper.work)
