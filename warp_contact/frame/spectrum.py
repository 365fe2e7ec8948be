"""The fastest elastic mode and the fastest damping of a scene, for the choice of the step."""

from collections.abc import Callable

import numpy as np
import warp as wp

from warp_contact.data.implicit import Shapes
from warp_contact.data.model import Model
from warp_contact.frame.krylov import ritz_pairs, start_vectors
from warp_contact.frame.worlds import WorldIds
from warp_contact.kernels.elastic import neo_hookean, shape
from warp_contact.kernels.motion import lanczos
from warp_contact.step import forces

DEPTH = 8  # Lanczos steps of a restart in the first call
SHORT = 4  # in later calls
CHUNK = 64  # vertices summed by one thread
FIRST, LATER = (3, 8), (1, 2)  # fewest and most restarts in the first call, in later calls
NOISE = 0.1  # random part of a restart, so that a mode elsewhere can appear
CONVERGED = 0.02  # gap between estimate and bound at which restarts end, relative to lambda
LITTLE = 0.01  # change of shape, see elastic/shape.py, that moves a rate by some percent at most
MUCH = 0.2  # change that makes a frequency at most SLOWER times as large, a damping its square
SLOWER = 4.0


class Spectrum:
    """Largest eigenvalues of M^-1 K and of M^-1 C, assembled, fixed vertices left out.

    Restarted Lanczos in the mass inner product, separately for every body but in the same
    launches, so that a small stiff body is not hidden by the others. The result is the largest
    |Ritz value| + residual norm of any body: there is an eigenvalue that close, and in practice
    it bounds the spectrum (Zhou, Saad, Tiago, Chelikowsky 2006, "Self-consistent-field
    calculations using Chebyshev-filtered subspace iteration"). On random meshes of
    up to 200 vertices omega came out 0 to 1.2 % too high; right after a sudden change of shape it
    can be some percent too low for a frame. ``rates`` are found again where shapes have changed.

    Later calls start from the last result and need ``SHORT`` products with K, or twice as many.
    Deterministic: the first start vector is a fixed random one. Reads back once per restart.

    Attributes:
        flat: worlds with a tet so flat, at the last call of ``rates``, that they may rise many
            times in a few steps, shape (n_world,)
    """

    def __init__(self, model: Model, worlds: WorldIds | None = None, shapes: Shapes | None = None):
        """Allocate about 160 bytes per vertex and 84 per tet on the current device.

        ``worlds`` are those that do not depend on each other; without them all bodies are one.
        Where there are ``shapes``, only bodies that are lumped limit the step: no other is looked
        at, and nothing is done where there are none.
        """
        self._counts = shapes.too_large if shapes else np.ones(model.n_body, dtype=bool)
        self._model = model = shapes.explicit if shapes else model
        self.worlds = worlds or WorldIds(model, apart=False)
        chunk, body_chunk = _chunks(model.body_vert.numpy())
        self._chunk = wp.array(chunk, dtype=int)
        self._body_chunk = wp.array(body_chunk, dtype=int)
        self._part = wp.empty(len(chunk) - 1, dtype=wp.float64)
        self._coef = wp.empty((2 * DEPTH + 1, model.n_body), dtype=wp.float64)
        self._ritz = wp.zeros((model.n_body, DEPTH), dtype=float)
        self._basis = wp.zeros((DEPTH + 1, model.n_vert), dtype=wp.vec3)
        self._f_tet = wp.zeros(4 * model.n_tet, dtype=wp.vec3)
        self._x = wp.empty(model.n_vert, dtype=wp.vec3)
        self._noise = wp.array(start_vectors(model, self.worlds), dtype=wp.vec3)
        self._start: dict[Callable, wp.array] = {}
        self._graph: dict[tuple[Callable, int], wp.Graph] = {}
        self._before = wp.zeros(model.n_tet, dtype=wp.mat33)
        self._change = wp.empty((2, model.n_body), dtype=float)
        self.flat = np.zeros(self.worlds.n, dtype=bool)
        self._at: np.ndarray | None = None
        self._of_bodies = np.zeros((2, model.n_body))

    def rates(self, x: wp.array, of: np.ndarray | None = None) -> np.ndarray:
        """Rates [1/s] of each world at ``x`` [m], or those kept while its shapes are close to them.

        Shape (2, n_world): the largest elastic frequency and damping rate. Rigid motion changes no
        rate. A body whose own rates are far below the largest of its world may change its shape by
        more than the others until they are found again. Only the worlds ``of``, a mask, are looked
        at; None for all.
        """
        if not self._counts.any():
            return np.zeros((2, self.worlds.n))
        of = np.ones(self.worlds.n, dtype=bool) if of is None else of
        change, flat = self._changes(x)
        self.flat = np.where(of, self.worlds.most(flat) > 0.0, self.flat)
        stale = of if self._at is None else of & self._stale(change)
        if stale.any():
            own = stale[self.worlds.of_vert, None]
            at = x.numpy().copy()
            self._at = at if self._at is None else np.where(own, at, self._at)
            self._remember(wp.array(self._at, dtype=wp.vec3))
            squares = self._bounds(forces.apply_stiffness, x, stale)
            found = squares**0.5, self._damping_rates(x, stale)
            self._of_bodies = np.where(stale[self.worlds.of_body], found, self._of_bodies)
        return self.worlds.most(self._of_bodies)

    def _remember(self, x: wp.array) -> None:
        """Keep the shapes at ``x`` [m]."""
        m = self._model
        wp.launch(shape.remember, dim=m.n_tet, inputs=[m.tets, x], outputs=[self._before])

    def _changes(self, x: wp.array) -> np.ndarray:
        """How far shapes at ``x`` [m] are from those kept, and where a tet is flat: (2, n_body)."""
        m = self._model
        self._change.zero_()
        inputs = [m.tets, m.vert_body, m.pose, self._before, x, neo_hookean.SQUASHED]
        wp.launch(shape.changes, dim=m.n_tet, inputs=inputs, outputs=[self._change])
        return np.where(self._counts, self._change.numpy(), 0.0)

    def _stale(self, change: np.ndarray) -> np.ndarray:
        """Worlds whose rates do not suffice after such changes of bodies, shape (n_body,)."""
        worlds = self.worlds
        most = worlds.most(self._of_bodies)
        slow = (self._of_bodies * [[SLOWER], [SLOWER**2]] <= most[:, worlds.of_body]).all(axis=0)
        late = ~(change <= np.where(slow, MUCH, LITTLE))
        return ~np.isfinite(most).all(axis=0) | (worlds.most(late.astype(float)) > 0.0)

    @property
    def of_bodies(self) -> np.ndarray:
        """Rates of each body [1/s], where ``rates`` were last asked for, shape (2, n_body)."""
        return self._of_bodies

    def omega(self, x: wp.array) -> float:
        """Angular frequency [1/s] of the fastest mode at the positions ``x`` [m].

        Symplectic Euler is stable for steps below 2 / omega. K may be indefinite: the largest
        magnitude counts. 0 when no vertex is free, inf when ``x`` is not finite.
        """
        return float(self._bounds(forces.apply_stiffness, x).max()) ** 0.5

    def damping_rate(self, x: wp.array) -> float:
        """Largest eigenvalue [1/s] of M^-1 C at the positions ``x`` [m]; 0 without damping."""
        return float(self._damping_rates(x).max())

    def memory(self) -> tuple:
        """What ``rates`` changes, as it is now."""
        starts = {apply: wp.clone(start) for apply, start in self._start.items()}
        return starts, self._at, self._of_bodies, self.flat

    def remind(self, memory: tuple, of: np.ndarray | None = None) -> None:
        """Put back what was kept in the ``memory``, which is used up; of some worlds, or of all."""
        if of is not None and not of.all() and self._at is not None:
            starts, at, of_bodies, flat = memory
            own = of[self.worlds.of_vert, None]
            for apply, start in starts.items():
                start.assign(np.where(own, start.numpy(), self._start[apply].numpy()))
            of_bodies = np.where(of[self.worlds.of_body], of_bodies, self._of_bodies)
            memory = starts, np.where(own, at, self._at), of_bodies, np.where(of, flat, self.flat)
        self._start, self._at, self._of_bodies, self.flat = memory
        if self._at is not None:
            self._remember(wp.array(self._at, dtype=wp.vec3))

    def forget(self, of: np.ndarray) -> None:
        """Let the next call begin as the first one in the worlds ``of``, a mask."""
        own = of[self.worlds.of_vert, None]
        for start in self._start.values():
            start.assign(np.where(own, np.float32(np.nan), start.numpy()))
        self._of_bodies = np.where(of[self.worlds.of_body], np.inf, self._of_bodies)
        self.flat = self.flat & ~of

    def starts(self) -> dict[str, np.ndarray]:
        """What the next calls start from."""
        starts = {apply.__name__: start.numpy() for apply, start in self._start.items()}
        if self._at is not None:
            starts |= {"at": self._at, "of_bodies": self._of_bodies, "flat": self.flat}
        return starts

    def start_from(self, starts: dict[str, np.ndarray]) -> None:
        """Let the next calls start from what ``starts`` gave."""
        applies = forces.apply_stiffness, forces.apply_damping
        self._start = {
            apply: wp.array(starts[apply.__name__], dtype=wp.vec3)
            for apply in applies
            if apply.__name__ in starts
        }
        self._at = starts.get("at")
        if self._at is not None:
            self._remember(wp.array(self._at, dtype=wp.vec3))
        self._of_bodies = starts.get("of_bodies", self._of_bodies)
        self.flat = starts.get("flat", np.zeros(self.worlds.n, dtype=bool))

    def _damping_rates(self, x: wp.array, of: np.ndarray | None = None) -> np.ndarray:
        """Bounds on the eigenvalues [1/s] of M^-1 C of each body, as ``_bounds``."""
        damped = [e.damped for e in self._model.elements]
        if not any(damped):
            return np.zeros(self._model.n_body)
        if not all(damped):
            self._f_tet.zero_()
        return self._bounds(forces.apply_damping, x, of)

    def _bounds(self, apply: Callable, x: wp.array, of: np.ndarray | None = None) -> np.ndarray:
        """Bounds on the eigenvalues of each body, shape (n_body,).

        Only those of the worlds ``of`` count, shape (n_world,), all without it. A world without a
        start, before its first call and where it was lost in the last one, begins with noise.
        """
        worlds = self.worlds
        of = np.ones(worlds.n, dtype=bool) if of is None else of
        if apply not in self._start:
            self._start[apply] = wp.full(self._model.n_vert, wp.vec3(np.nan), dtype=wp.vec3)
        start = self._start[apply].numpy().copy()
        none = np.isnan(start)
        begin = wp.array(np.where(none, self._noise.numpy(), start), dtype=wp.vec3)
        first = np.bincount(worlds.of_vert, none[:, 0], worlds.n) > 0
        wp.copy(self._x, x)
        out = np.zeros(self._model.n_body)
        for own, *how in ((of & first, DEPTH, *FIRST), (of & ~first, SHORT, *LATER)):
            if own.any():
                wp.copy(self._basis[0], begin)
                bounds, ends = self._converge(apply, own, *how)
                out = np.where(own[worlds.of_body], bounds, out)
                start = np.where(own[worlds.of_vert, None], ends, start)
        self._start[apply].assign(start)
        return out

    def _converge(
        self, apply: Callable, of: np.ndarray, depth: int, fewest: int, most: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Bounds on the eigenvalues of bodies in the worlds ``of``, and where later calls start.

        Each world ends where it has converged, whatever the others do. One that is not finite has
        infinite bounds, and no start.
        """
        worlds, going = self.worlds, of.copy()
        out = np.zeros(self._model.n_body)
        ends = np.full((self._model.n_vert, 3), np.nan, dtype=np.float32)
        for cycle in range(most):
            self._cycle(apply, depth)
            coef = self._coef.numpy()[: 2 * depth + 1]
            lost = ~np.isfinite(coef).all(axis=0)
            theta, residual, ritz = ritz_pairs(np.where(lost, 0.0, coef))
            self._restart(ritz)
            bound = theta + residual
            done = worlds.most(bound) <= (1.0 + CONVERGED) * worlds.most(theta)
            done = done & (cycle + 1 >= fewest) | (cycle + 1 == most)
            gone = worlds.most(lost.astype(float)) > 0.0
            ended = going & (done | gone)
            out = np.where(ended[worlds.of_body], np.where(lost, np.inf, bound), out)
            if (ended & ~gone).any():
                own = (ended & ~gone)[worlds.of_vert, None]
                ends = np.where(own, self._basis[0].numpy(), ends)
            going &= ~ended
            if not going.any():
                break
        return out, ends

    def _restart(self, ritz: np.ndarray) -> None:
        """Set row 0 of the basis to a sum of its rows for each body, plus noise."""
        m = self._model
        padded = np.zeros((m.n_body, DEPTH), dtype=np.float32)
        padded[:, : ritz.shape[1]] = ritz
        self._ritz.assign(padded)
        wp.launch(
            lanczos.restart,
            dim=m.n_vert,
            inputs=[m.inv_mass, self._noise, m.vert_body, self._ritz, NOISE],
            outputs=[self._basis],
        )

    def _cycle(self, apply: Callable, depth: int) -> None:
        """Run ``depth`` Lanczos steps from row 0 of the basis; sets ``coef``."""
        if (apply, depth) not in self._graph:
            with wp.ScopedCapture() as capture:
                self._orthogonalise(-1)
                for j in range(depth):
                    apply(self._model, self._x, self._basis[j], self._f_tet)
                    self._multiply(j)
                    self._orthogonalise(j)
            self._graph[apply, depth] = capture.graph
        wp.capture_launch(self._graph[apply, depth])

    def _multiply(self, j: int) -> None:
        m = self._model
        inputs = [self._chunk, m.vt_start, m.vt_corner, self._f_tet, m.mass, m.inv_mass, j]
        outputs = [self._basis, self._part]
        wp.launch(lanczos.multiply, dim=self._part.shape[0], inputs=inputs, outputs=outputs)
        self._add_up(2 * j + 1)

    def _orthogonalise(self, j: int) -> None:
        m = self._model
        inputs = [self._chunk, m.vert_body, m.mass, self._coef, j]
        outputs = [self._basis, self._part]
        wp.launch(lanczos.orthogonalise, dim=self._part.shape[0], inputs=inputs, outputs=outputs)
        self._add_up(2 * j + 2)
        inputs = [m.vert_body, self._coef, j + 1]
        wp.launch(lanczos.normalise, dim=m.n_vert, inputs=inputs, outputs=[self._basis])

    def _add_up(self, row: int) -> None:
        inputs = [self._body_chunk, self._part, row]
        wp.launch(lanczos.add_up, dim=self._model.n_body, inputs=inputs, outputs=[self._coef])


def _chunks(body_vert: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First vertex of each chunk, closed by n_vert, and first chunk of each body."""
    count = -(-np.diff(body_vert) // CHUNK)
    body_chunk = np.concatenate([[0], np.cumsum(count)])
    within = np.arange(body_chunk[-1]) - np.repeat(body_chunk[:-1], count)
    first = np.repeat(body_vert[:-1], count) + CHUNK * within
    return np.append(first, body_vert[-1]), body_chunk
