"""Tets that implicit steps crush: what is flat is stiffer than its mobility says.

An explicit step that is too long shows in the frequency that it is held against. Implicit steps are
stable, but impulses reckon with the stiffness at rest. A frame after which tets are flatter than
before is repeated with twice as many steps, ``TIMES`` at most. As long as any is flat, the next
frame takes as many as this one, then half as many at least.
"""

import numpy as np

from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.frame.step_bounds import served
from warp_contact.frame.worlds import Worlds

FLAT = 0.1  # of its volume at rest: a tet with less is flat
TIMES = 6  # a frame is repeated, at most
AGAIN = 2.0  # times the steps
KEPT = 0.5  # part of the steps that the next frame takes at least


class Inversion:
    """How flat the tets of each world are, and how often a frame was repeated for it."""

    def __init__(self, model: Model, worlds: Worlds, implicit: bool):
        """Read the tets once; explicit steps, not ``implicit``, have frequencies for it."""
        self._implicit = implicit
        self._tets = model.tets.numpy()
        self._volume = 6.0 * model.volume.numpy().astype(np.float64)
        self._of_tet = worlds.of_vert[self._tets[:, 0]]
        self._n = worlds.n
        self._before = np.zeros(worlds.n)
        self._times = np.zeros(worlds.n, dtype=int)

    def begin(self, state: State) -> None:
        """Begin a frame."""
        if self._implicit:
            self._before = self._missing(state)
            self._times[:] = 0

    def held_against(self, rates: np.ndarray, state: State, dt: np.ndarray) -> np.ndarray:
        """The ``rates`` [1/s], (2, n_world), which steps ``dt`` [s] are held against."""
        if not self._implicit:
            return rates
        missing = self._missing(state)
        worse = ~(missing <= self._before) & ((self._times < TIMES) | ~np.isfinite(missing))
        kept = np.where(self._times > 0, KEPT, 0.0)
        kept = np.where(missing > 0.0, 1.0, kept)
        self._times += worse
        return np.stack([np.where(worse, AGAIN, kept) * served(dt), rates[1]])

    def _missing(self, state: State) -> np.ndarray:
        """How much of its volume the flat tets lack to be not flat, summed over each world."""
        a, b, c, d = np.moveaxis(state.x.numpy()[self._tets], 1, 0)
        ratio = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / self._volume
        return np.bincount(self._of_tet, np.maximum(FLAT - ratio, 0.0), self._n)
