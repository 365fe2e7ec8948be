"""Worlds with fewer steps begin later in a frame, so that all end it together.

All worlds that have begun share every launch. Those that wait are left alone like bodies asleep,
but keep their velocities: their step is 0. What a world takes over from the last frame is put back
when it begins, since the steps of others have cleared it.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import warp as wp

from warp_contact.data.model import Model
from warp_contact.data.state import Awake
from warp_contact.data.work import Work
from warp_contact.frame.frame_start import FrameStart
from warp_contact.frame.worlds import Worlds


class Turns:
    """Knows which worlds have begun; its ``awake`` says what moves."""

    def __init__(self, model: Model, worlds: Worlds):
        """All have begun."""
        self._model, self._worlds = model, worlds
        self.awake = Awake(
            bodies=wp.full(model.n_body, 1, dtype=int),
            tets=wp.full(model.n_tet, 1, dtype=int),
            inv_mass=wp.clone(model.inv_mass),
        )
        self._of_tet = model.tet_body.numpy()[: model.n_tet]
        self._begun = np.ones(worlds.n, dtype=bool)

    def let_all(self, work: Work) -> None:
        """Let all worlds move."""
        self._let(np.ones(self._worlds.n, dtype=bool), work)

    def begin(self, begun: np.ndarray, dt: np.ndarray, work: Work, start: FrameStart) -> None:
        """Let those worlds that have ``begun`` (n,) move in steps ``dt`` [s] (n,)."""
        before = self._begun
        if before.all():  # the frame begins, or none will begin later
            start.begin_steps(work)
        self._let(begun, work)
        work.dt.assign(np.where(begun, dt, 0.0)[self._worlds.of_vert].astype(np.float32))
        anew = begun & ~before
        if anew.any():
            edge_vert = self._model.edges.numpy()[:, 0]
            start.recall(work, anew[self._worlds.of_vert], anew[self._worlds.of_vert[edge_vert]])

    def _let(self, begun: np.ndarray, work: Work) -> None:
        if (begun == self._begun).all():
            return
        self._begun = begun.copy()
        worlds, awake = self._worlds, self.awake
        awake.bodies.assign(begun[worlds.of_body].astype(np.int32))
        awake.tets.assign(begun[worlds.of_body[self._of_tet]].astype(np.int32))
        inv_mass = self._model.inv_mass.numpy()
        awake.inv_mass.assign(np.where(begun[worlds.of_vert], inv_mass, np.float32(0.0)))
        work.broad_phase.stale.fill_(1)


def segments(n: np.ndarray, part: int) -> Iterator[tuple[int, np.ndarray, str]]:
    """Numbers of steps to take at once, ``part`` at most, and which worlds have begun by then.

    ``n`` are the steps of each world in the frame, shape (n,). The third value says whether a part
    or the frame ends with these steps: what others do must not decide when a world is looked at.
    """
    most = int(n.max())
    starts = {*(most - np.unique(n)).tolist(), *range(0, most, part)}
    bounds = [*sorted(starts), most]
    for first, last in pairwise(bounds):
        ends = "frame" if last == most else "part" if last % part == 0 else ""
        yield last - first, most - n <= first, ends
