"""Tets that implicit steps crush, or strain too much at once.

An explicit step that is too long shows in the frequency that it is held against. Implicit ones are
stable, but they go along the tangent, and impulses reckon with the stiffness at rest: what is flat
is stiffer than that, and a large strain in one step may add energy. A frame after which tets are
flatter than before, or strained by more than ``STRAIN`` in a step, is repeated with twice as many
steps, ``TIMES`` at most. What is flat needs no more of them than explicit steps would be: these
mobilities are then as good as inverse masses. As long as any is flat, the next frame takes as many
as this one, or that many, then half as many at least.
"""

import numpy as np

from warp_contact.data.implicit import Shapes
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.frame import elements
from warp_contact.frame.step_bounds import served
from warp_contact.frame.worlds import WorldIds
from warp_contact.step.forces import apply_stiffness

FLAT = 0.1  # of its volume at rest: a tet with less is flat
STRAIN = 0.2  # in a step, the largest of any tet; a ball at 0.7 of its speed of sound needs it
TIMES = 6  # a frame is repeated, at most
AGAIN = 2.0  # times the steps
KEPT = 0.5  # part of the steps that the next frame takes at least


class Inversion:
    """How flat the tets of each world are, and how often a frame was repeated for it."""

    def __init__(self, model: Model, worlds: WorldIds, shapes: Shapes | None):
        """Read the tets once, but for those of bodies that take explicit steps.

        These have frequencies for it; without ``shapes`` all have.
        """
        self._implicit = shapes is not None
        tets, volume = model.tets.numpy(), 6.0 * model.volume.numpy().astype(np.float64)
        body = model.vert_body.numpy()
        of_tet = body[tets[:, 0]]
        lumped = shapes.too_large if shapes else np.ones(model.n_body, dtype=bool)
        own = np.flatnonzero(~lumped[of_tet])
        self._tets, self._volume = tets[own], volume[own]
        self._pose = model.pose.numpy()[own].astype(np.float64)
        self._of_tet = worlds.of_vert[self._tets[:, 0]]
        self._apart = elements.apart(model, own) if shapes else None
        volume = np.bincount(of_tet, volume / 6.0, model.n_body)
        density = np.bincount(body, model.mass.numpy(), model.n_body) / volume
        self._mass = density[of_tet[own]] * self._volume / 24.0
        self._n = worlds.n
        self._before = np.zeros(worlds.n)
        self._times = np.zeros(worlds.n, dtype=int)

    def begin(self, state: State) -> None:
        """Begin a frame."""
        if self._implicit:
            self._before = self._missing(self._ratios(state))
            self._times[:] = 0

    def held_against(self, rates: np.ndarray, state: State, dt: np.ndarray) -> np.ndarray:
        """What steps ``dt`` [s] are held against [1/s], from the ``rates`` of explicit ones.

        Both have the shape (2, n_world).
        """
        if not self._implicit:
            return rates
        ratios = self._ratios(state)
        missing = self._missing(ratios)
        strained = self._strain_rate(state) * dt > STRAIN
        now, enough = served(dt), self._frequency_of_flat(state, ratios)
        worse = (~(missing <= self._before) & ~(now >= enough)) | strained
        worse &= (self._times < TIMES) | ~np.isfinite(missing)
        kept = np.where(self._times > 0, KEPT * now, 0.0)
        kept = np.where(missing > 0.0, np.minimum(now, enough), kept)
        self._times += worse
        slowed = np.where(worse, AGAIN * now, kept)
        return np.stack([np.maximum(rates[0], slowed), rates[1]])

    def _missing(self, ratios: np.ndarray) -> np.ndarray:
        """How much of its volume the flat tets lack to be not flat, summed over each world."""
        return np.bincount(self._of_tet, np.maximum(FLAT - ratios, 0.0), self._n)

    @np.errstate(invalid="ignore")  # what is not finite is told by the vertex
    def _ratios(self, state: State) -> np.ndarray:
        """Volume of each tet over that at rest, shape (n_tet,)."""
        a, b, c, d = np.moveaxis(state.x.numpy()[self._tets], 1, 0)
        return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / self._volume

    def _frequency_of_flat(self, state: State, ratios: np.ndarray) -> np.ndarray:
        """A bound on the frequency of the flat tets of each world [1/s], 0 without, (n_world,).

        The largest of single tets with their shares of the masses (Irons and Treharne 1971).
        """
        most = np.zeros(self._n)
        flat = np.flatnonzero(~(ratios >= FLAT))
        if len(flat):
            corners = state.x.numpy()[self._tets]
            k = elements.matrices(self._apart, apply_stiffness, corners)[flat]
            size = np.abs(k).sum(axis=2).max(axis=1)  # no eigenvalue is larger
            size = np.nan_to_num(size, nan=np.inf, posinf=np.inf)
            np.maximum.at(most, self._of_tet[flat], np.sqrt(size / self._mass[flat]))
        return most

    def _strain_rate(self, state: State) -> np.ndarray:
        """Largest rate of Green's strain of a tet in each world [1/s], shape (n_world,)."""
        f, rate = (self._gradients(a.numpy()) for a in (state.x, state.v))
        e = np.einsum("tki,tkj->tij", f, rate)
        size = 0.5 * np.linalg.norm(e + e.swapaxes(1, 2), axis=(1, 2))
        largest = np.zeros(self._n)
        np.maximum.at(largest, self._of_tet, size)
        return largest

    def _gradients(self, u: np.ndarray) -> np.ndarray:
        """Gradient of ``u``, shape (n_vert, 3), over each tet, shape (n_tet, 3, 3)."""
        at = u[self._tets].astype(np.float64)
        return (at[:, 1:] - at[:, :1]).swapaxes(1, 2) @ self._pose
