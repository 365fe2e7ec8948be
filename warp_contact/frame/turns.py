"""Worlds with fewer steps begin later in a frame, so that all end it together.

All worlds that have begun share every launch. Those that wait are left alone like bodies asleep,
but keep their velocities: their step is 0. What a world takes over from the last frame is put back
when it begins, since the steps of others have cleared it. A world that sleeps as a whole takes no
step, and ends the frame as it was.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import warp as wp

from warp_contact.data.model import Model
from warp_contact.data.work import Work, everything
from warp_contact.frame.frame_start import FrameStart
from warp_contact.frame.worlds import WorldIds


class Turns:
    """Knows which worlds have begun and which bodies sleep.

    Attributes:
        worlds: those of the scene
        inv_mass: of vertices that take explicit steps, 0 for the others [1/kg], shape (n_vert,)
        awake: what moves
        idle: worlds of which all bodies sleep, shape (n_world,)
    """

    def __init__(self, model: Model, worlds: WorldIds, may_sleep: bool):
        """All have begun, nothing sleeps; in the ``model`` moves what takes explicit steps."""
        self._model, self.worlds, self.inv_mass = model, worlds, model.inv_mass
        self.awake = everything(model)
        if worlds.n > 1 or may_sleep:
            self.awake.inv_mass = wp.clone(model.inv_mass)
        self._of_tet = model.tet_body.numpy()[: model.n_tet]
        self._begun = np.ones(worlds.n, dtype=bool)
        self._up = np.ones(model.n_body, dtype=bool)
        self.idle = np.zeros(worlds.n, dtype=bool)

    def sleep(self, up: np.ndarray) -> None:
        """Let all bodies sleep but those that are ``up``, shape (n_body,); between frames.

        What moves of the vertices is up to ``Sleeping``, when the frame begins.
        """
        self._up = up > 0
        self.idle = np.bincount(self.worlds.of_body, self._up, self.worlds.n) == 0
        self.awake.tets.assign(self._up[self._of_tet].astype(np.int32))

    def let_all(self, work: Work) -> None:
        """Let all worlds move."""
        self._let(np.ones(self.worlds.n, dtype=bool), work)

    def begin(self, begun: np.ndarray, dt: np.ndarray, work: Work, start: FrameStart) -> None:
        """Let those worlds that have ``begun`` (n,) move in steps ``dt`` [s] (n,)."""
        if self.worlds.n == 1:
            return
        before = self._begun
        if before.all():  # the frame begins, or none will begin later
            start.begin_steps(work)
        self._let(begun | self.idle, work)
        work.dt.assign(np.where(begun, dt, 0.0)[self.worlds.of_vert].astype(np.float32))
        self._recall(begun & ~before, work, start, begins=True)

    def end(self, work: Work, start: FrameStart) -> None:
        """The frame has ended: worlds that sleep take over what they had at its start."""
        self._recall(self.idle, work, start, begins=False)

    def _recall(self, of: np.ndarray, work: Work, start: FrameStart, begins: bool) -> None:
        if of.any():
            of_vert, edge_vert = self.worlds.of_vert, self._model.edges.numpy()[:, 0]
            start.recall(work, of[of_vert], of[of_vert[edge_vert]], begins)

    def _let(self, begun: np.ndarray, work: Work) -> None:
        if (begun == self._begun).all():
            return
        self._begun = begun.copy()
        moves, awake = begun[self.worlds.of_body] & self._up, self.awake
        awake.bodies.assign(moves.astype(np.int32))
        awake.tets.assign(moves[self._of_tet].astype(np.int32))
        inv_mass, of_vert = self.inv_mass.numpy(), self._model.vert_body.numpy()
        awake.inv_mass.assign(np.where(moves[of_vert], inv_mass, np.float32(0.0)))
        work.broad_phase.stale.fill_(1)


def segments(
    n: np.ndarray, in_parts: np.ndarray, part: int
) -> Iterator[tuple[int, np.ndarray, np.ndarray | None]]:
    """Numbers of steps to take at once, which worlds have begun by then, and which to look at then.

    ``n`` are the steps of each world in the frame, shape (n,), 0 for one that sleeps. WorldIds
    ``in_parts``, a mask, are looked at after every ``part`` steps of their own: what others do must
    not decide when. At the end of the frame all are, None.
    """
    most = int(n.max())
    first = most - n
    bounds = {most, *first[n > 0].tolist()}
    for w in np.flatnonzero(in_parts & (n > 0)):
        bounds.update(range(int(first[w]), most, part))
    for begin, end in pairwise(sorted(bounds)):
        looked = in_parts & (first < end) & ((end - first) % part == 0)
        yield end - begin, first <= begin, None if end == most else looked
