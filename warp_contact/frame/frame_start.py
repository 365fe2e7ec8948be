"""What a frame changes on the device, as it was when the frame began."""

import numpy as np
import warp as wp

from warp_contact.data import contact_forces, damping, warm_start
from warp_contact.data.state import State
from warp_contact.data.work import Work


class FrameStart:
    """Keeps the state, the impulses that its first step starts from, and the contact forces."""

    def __init__(self, state: State, work: Work):
        """Keep what is now."""
        self._x, self._v = wp.clone(state.x), wp.clone(state.v)
        self._warm = warm_start.copied(work.warm)
        self._damping, self._scaled = (damping.copied(work.damping) for _ in range(2))
        self._forces = contact_forces.copied(work.forces)
        self._ties = work.ties.copied() if work.ties else None

    def keep(self, state: State, work: Work) -> None:
        """Keep what is now; memory is allocated only where buffers have grown."""
        if len(work.warm.edges) != len(self._warm.edges) or self.n_pair != work.capacity.pairs:
            FrameStart.__init__(self, state, work)
            return
        wp.copy(self._x, state.x)
        wp.copy(self._v, state.v)
        warm_start.copy(self._warm, work.warm)
        damping.keep(self._damping, work.damping)
        contact_forces.copy(self._forces, work.forces)
        self._ties = work.ties.copied() if work.ties else None

    def go_back(self, state: State, work: Work) -> None:
        """Restore the state and the warm start; ``work`` may have more room than there was.

        Its lists of pairs may be incomplete, where they did not fit: they are found anew.
        """
        wp.copy(state.x, self._x)
        wp.copy(state.v, self._v)
        warm_start.copy(work.warm, self._warm)
        damping.copy(work.damping, self._damping)
        if work.ties:
            work.ties.copy(self._ties)
        work.broad_phase.stale.fill_(1)

    def begin_steps(self, work: Work) -> None:
        """Keep the damping as it is for the length of the steps, for worlds that begin later."""
        damping.keep(self._scaled, work.damping)

    def recall(self, work: Work, verts: np.ndarray, edges: np.ndarray, begins: bool) -> None:
        """Restore what vertices and edges, masks, take over from the last frame.

        For those of which the frame ``begins`` now, or for those without a step in it.
        """
        warm_start.recall(work.warm, self._warm, verts, edges, work.overflow.contacts)
        damping.recall(work.damping, self._scaled if begins else self._damping, verts)

    def undo(self, state: State, work: Work) -> None:
        """Restore all, as if the frame had not begun."""
        self.go_back(state, work)
        work.forces.pair_key.fill_(-1)
        contact_forces.copy(work.forces, self._forces)

    @property
    def n_pair(self) -> int:
        """Pairs of bodies that there was room for."""
        return self._forces.pair_key.shape[0]
