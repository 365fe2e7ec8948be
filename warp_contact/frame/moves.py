"""Held vertices on their way to a place that they reach after a number of frames.

    x(s) = R(s) q + p(s) + (1 - s) a + s b,   s = frames gone / frames in all               [m]
    R(s) = exp(s w) R_0,   p(s) = p_0 + s (p_1 - p_0)

q are the vertices of a mesh whose origin goes straight from p_0 to p_1 while it turns at a constant
rate from R_0 to exp(w) R_0. a is how far a vertex begins beside it, b how far it ends. Where
vertices go straight q is 0. Within a frame each of them goes straight to its next place.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import warp as wp

from warp_contact.data.state import State

OF_VERTEX = {"at": (), "move": (), "goal": (3,), "q": (3,), "a": (3,), "b": (3,)}
OF_MOVE = {"over": (), "done": (), "place": (2, 3), "turn": (3, 3), "w": (3,)}
TURN = 0.5  # [rad] in a frame at most: the chords of its arcs are then 1 % short
WHOLE = ("at", "move", "over", "done")  # numbers; the rest is float64


class Moves:
    """All moves of a simulation; each vertex is in one at most, the last that it was given."""

    def __init__(self):
        """Nothing moves."""
        self._given: list[dict[str, np.ndarray]] = []  # one for each ``begin`` since ``_join``
        self.clear()

    def clear(self) -> None:
        """Nothing moves any more; velocities stay."""
        self._given.clear()
        every = OF_VERTEX | OF_MOVE
        kinds = {name: int if name in WHOLE else float for name in every}
        self._now = {name: np.zeros((0, *every[name]), dtype=kinds[name]) for name in every}

    def begin(self, at: np.ndarray, x: np.ndarray, goal: np.ndarray, over: int, mesh=None) -> None:
        """Let vertices move from the next frame on, in place of what they did.

        Args:
            at: which, among all, shape (k,)
            x: where they are [m], shape (k, 3)
            goal: where they shall be after ``over`` frames [m], float32 (k, 3)
            over: number of frames
            mesh: None where they go straight; else vertices q [m], shape (k, 3), and the pose,
                translation and rotation matrix, from which and the one to which these turn

        Raises:
            ValueError: they would turn by more than ``TURN`` a frame
        """
        still = np.zeros((len(at), 3)), *2 * ((np.zeros(3), np.eye(3)),)
        q, *poses = still if mesh is None else mesh
        place, turn = (np.array(values) for values in zip(*poses, strict=True))
        a, b = (y - q @ r.T - p for y, p, r in zip((x, goal), place, turn, strict=True))
        of_vertex = {"at": at, "move": np.zeros(len(at), dtype=int), "goal": goal, "q": q}
        w = rotation_vector(turn[1] @ turn[0].T)
        angle = float(np.linalg.norm(w))
        if angle > TURN * over:
            wrong = f"it would turn by {angle / over:.2g} rad a frame, and go straight within it"
            least = int(np.ceil(angle / TURN))
            raise ValueError(f"{wrong}: give over={least} or more frames, or a higher fps")
        of_move = {"over": over, "done": 0, "place": place, "turn": turn[0], "w": w}
        of_move = {name: np.array([value]) for name, value in of_move.items()}
        self._given.append(of_vertex | {"a": a, "b": b} | of_move)

    def end(self, at: np.ndarray, state: State) -> None:
        """Let vertices ``at`` (k,) stand still if they are on their way."""
        self._join()
        stop = np.isin(self._now["at"], at)
        if stop.any():
            _assign(state.v, self._now["at"][stop], 0.0)
            self._keep(~stop)

    @contextmanager
    def frame(self, state: State, fps: float) -> Iterator[np.ndarray]:
        """Let them move during the frame that is stepped within; one that fails changes nothing.

        Those that are there stand still from the next frame on; till then they have the velocity
        with which they came. It yields the vertices that move, shape (k,).
        """
        self._join()
        at, before = self._now["at"], None
        there = (self._now["done"] == self._now["over"])[self._now["move"]]
        try:
            if len(at):
                before = wp.clone(state.v)
                speed = fps * (self._where(1) - state.x.numpy()[at])
                _assign(state.v, at, np.where(there[:, None], 0.0, speed))
            yield at
        except BaseException:
            if before is not None:
                wp.copy(state.v, before)
            raise
        self._keep(~there)
        self._now["done"] += 1
        reached = (self._now["done"] == self._now["over"])[self._now["move"]]
        if reached.any():
            _assign(state.x, self._now["at"][reached], self._now["goal"][reached])

    def values(self) -> dict[str, np.ndarray]:
        """What a checkpoint needs."""
        self._join()
        return self._now

    def restore(self, values: dict[str, np.ndarray]) -> None:
        """Take over what ``values`` gave."""
        self._given.clear()
        self._now = values

    def _where(self, frames: int) -> np.ndarray:
        """Places [m] so many frames later, shape (k, 3)."""
        v = self._now
        s = (v["done"] + frames) / v["over"]
        turn = rotations(s[:, None] * v["w"]) @ v["turn"]
        place = v["place"][:, 0] + s[:, None] * (v["place"][:, 1] - v["place"][:, 0])
        m, part = v["move"], s[v["move"], None]
        beside = (1.0 - part) * v["a"] + part * v["b"]
        return np.einsum("kij,kj->ki", turn[m], v["q"]) + place[m] + beside

    def _join(self) -> None:
        """Let those given since then move too."""
        if not self._given:
            return
        parts = [self._now, *self._given]
        first = np.cumsum([0, *(len(part["over"]) for part in parts)])
        moves = [part["move"] + i for part, i in zip(parts, first, strict=False)]
        self._now = {k: np.concatenate([part[k] for part in parts]) for k in self._now}
        self._now["move"] = np.concatenate(moves)
        self._given.clear()
        at = self._now["at"]
        last = np.zeros(len(at), dtype=bool)
        last[len(at) - 1 - np.unique(at[::-1], return_index=True)[1]] = True
        self._keep(last)

    def _keep(self, chosen: np.ndarray) -> None:
        """Forget all vertices but those ``chosen``, a mask, and the moves of the others."""
        now = {name: self._now[name][chosen] for name in OF_VERTEX}
        used, now["move"] = np.unique(now["move"], return_inverse=True)
        self._now = now | {name: self._now[name][used] for name in OF_MOVE}


def _assign(array: wp.array, at: np.ndarray, values) -> None:
    """Set values of the vertices ``at``."""
    every = array.numpy().copy()
    every[at] = values
    array.assign(every)


def rotation_vector(turn: np.ndarray) -> np.ndarray:
    """Axis times angle [rad], at most pi, of a rotation matrix, shape (3,)."""
    skew = 0.5 * np.array(
        [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
    )
    sine, cosine = np.linalg.norm(skew), 0.5 * (np.trace(turn) - 1.0)
    if sine > 1e-6:
        return np.arctan2(sine, cosine) / sine * skew
    if cosine > 0.0:
        return skew
    # Half a turn: R = 2 n n^T - I.
    column = (turn + np.eye(3))[:, np.argmax(np.diag(turn))]
    return np.pi * column / np.linalg.norm(column)


def rotations(w: np.ndarray) -> np.ndarray:
    """Rotation matrices about axes ``w`` (n, 3) by their lengths [rad] (Rodrigues), (n, 3, 3)."""
    angle = np.linalg.norm(w, axis=1)[:, None, None] / np.pi
    k = np.swapaxes(np.cross(w[:, None], np.eye(3)), 1, 2)  # k y = w x y
    s, c = np.sinc(angle), 0.5 * np.sinc(0.5 * angle) ** 2
    return np.eye(3) + s * k + c * (k @ k)
