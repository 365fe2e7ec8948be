"""In which worlds bodies overlap before the first step, or after positions were set."""

from collections.abc import Callable

import numpy as np

from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.frame.buffers import Buffers
from warp_contact.step import broad_phase, residual
from warp_contact.step.detection import detect_vertices


def overlaps(model: Model, state: State, work: Work) -> np.ndarray:
    """Worlds in which vertices lie deep enough in other bodies for a search; reads back.

    Pairs and contacts that did not fit were not tested: see ``work.overflow``.
    """
    work.dt.fill_(1.0)
    work.worlds.apart.zero_()
    work.overflow.all.zero_()
    broad_phase.refresh(model, state.x, state.x, work)
    detect_vertices(model, state.x, state.x, work)
    residual.find_gaps(model, state.x, work)
    return work.surface.old.numpy() > 0


def find_overlaps(
    model: Model, state: State, buffers: Buffers, known: np.ndarray, grow: Callable[[], bool]
) -> np.ndarray:
    """Worlds with overlaps that no step created, a mask.

    What is ``known`` of each world is as in ``LastFrame.overlapping``: the others are looked at,
    again as long as the buffers ``grow``.
    """
    unknown, found = known < 0, known > 0
    again = unknown.any()
    while again:
        found |= unknown & overlaps(model, state, buffers.work)
        again = grow()
    return found
