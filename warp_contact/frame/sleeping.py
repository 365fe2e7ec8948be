"""Sleeping: nothing is computed for islands at rest until something comes near.

A body falls asleep within ``STILL`` edges of where it was ``REST_TIME`` before. Asleep, it has the
contact forces and pressures of its last frame awake, and counts no contacts. Momentum and energy
change by the motion that is stopped. A body that creeps slower than ``STILL`` in ``REST_TIME`` is
stopped too, unless moving fixed vertices drive it. ``Simulation.set_velocity`` wakes a body; a
small velocity written into ``Simulation.state`` is lost on a sleeping one.

Only under gravity: a body that stays in place despite its weight is supported, else it may be in
free flight.
"""

import math

import numpy as np
import warp as wp

from warp_contact.data import boxes
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.frame.turns import Turns
from warp_contact.kernels.motion import sleeping as kernels
from warp_contact.step.ties import wake_attached

REST_TIME = 0.5  # s that a body has to be at rest before it may sleep


class Sleeping:
    """Knows for how long each body has been at rest; ``turns`` lets those sleep that it says."""

    def __init__(self, model: Model, state: State, fps: float, turns: Turns):
        """Everything is awake; frames come ``fps`` times a second."""
        self.model, self.awake, self._turns = model, turns.awake, turns
        self._time = 1.0 / fps
        self._wanted = max(2, math.ceil(REST_TIME * fps))
        self._anchor = wp.clone(state.x)
        self._frames = wp.zeros(model.n_body, dtype=int)
        self._moved, self._world, self._idle = (wp.zeros(model.n_body, dtype=int) for _ in range(3))
        free = np.bincount(model.vert_body.numpy(), model.inv_mass.numpy() > 0.0, model.n_body)
        self._mobile = wp.array(free > 0, dtype=int)
        self._reach = wp.zeros(model.n_body, dtype=float)
        self._speed = wp.zeros(turns.worlds.n, dtype=float)
        self._again = wp.zeros(1, dtype=int)
        self._before = np.ones(model.n_body, dtype=np.int32)  # awake in the last frame

    def values(self, work: Work) -> dict[str, np.ndarray]:
        """What another instance needs to continue from here."""
        awake = np.append(self.awake.bodies.numpy() == 1, np.zeros(self.model.n_plane, dtype=bool))
        key, total = work.forces.pair_key.numpy(), work.forces.pair_total.numpy()
        key, total = key[key >= 0], total[key >= 0]
        kept = ~awake[key >> 32] & ~awake[key & 0xFFFFFFFF]
        asleep = ~awake[self.model.vert_body.numpy()]
        return {
            "anchor": self._anchor.numpy(),
            "frames": self._frames.numpy(),
            "awake": self.awake.bodies.numpy(),
            "impulse": np.where(asleep[:, None], work.forces.received.numpy(), np.float32(0.0)),
            "pair_key": key[kept],
            "pair_total": total[kept],
        }

    def restore(self, values: dict[str, np.ndarray], work: Work) -> None:
        """Take over the ``values`` of another instance; its pairs fit into ``work``."""
        n = len(values["pair_key"])
        self._anchor.assign(values["anchor"])
        self._frames.assign(values["frames"])
        self.awake.bodies.assign(values["awake"])
        self._before = values["awake"]
        self._pause(work)
        work.forces.received.assign(values["impulse"])
        if n:
            work.forces.pair_key[:n].assign(values["pair_key"])
            work.forces.pair_total[:n].assign(values["pair_total"])

    def save(self) -> None:
        """Keep what ``update`` changes."""
        arrays = self._anchor, self._frames, self.awake.bodies, self.awake.inv_mass
        self._saved = [(array, wp.clone(array)) for array in arrays]
        self._saved_before = self._before

    def undo(self) -> None:
        """Put back what was kept."""
        for array, kept in self._saved:
            wp.copy(array, kept)
        self._before = self._saved_before
        self._turns.sleep(self._before)

    def wake(self, body: int) -> None:
        """Wake a body: its rest begins again."""
        self._frames[body : body + 1].zero_()

    def wake_all(self, of: np.ndarray, work: Work) -> None:
        """Wake all bodies of worlds, a mask: in the next frame they are awake and begin to rest."""
        own = of[self._turns.worlds.of_body]
        self._frames.assign(np.where(own, 0, self._frames.numpy()).astype(np.int32))
        self._before = np.where(own, 1, self._before).astype(np.int32)
        self.awake.bodies.assign(self._before)
        self._pause(work)

    def update(self, state: State, work: Work, of: np.ndarray) -> bool:
        """Before a frame: decide which bodies of worlds, a mask, sleep.

        Where all bodies of the scene do, stop everything, and return False.
        """
        self._count_rest(state, of & self.model.gravity.any())
        bodies = self.awake.bodies.numpy()
        if bodies.all() and self._before.all():
            return True
        broad = work.broad_phase
        boxes.of_bodies(self.model, state.x, self._reach, broad.lower, broad.upper)
        broad.bodies.rebuild()
        self._again.fill_(1)
        wp.capture_while(self._again, lambda: self._wake(work))
        bodies = self.awake.bodies.numpy()
        if (bodies != self._before).any():
            self._before = bodies.copy()
            self._pause(work)
        if not bodies.any():
            self._skip_frame(state, work)
        return bool(bodies.any())

    def _count_rest(self, state: State, of: np.ndarray) -> None:
        """Count for how long bodies of worlds, a mask, have been at rest: the others are awake."""
        model, of_body = self.model, self._turns.worlds.of_body
        self._world.assign(np.where(of[of_body], of_body, -1).astype(np.int32))
        self._moved.zero_()
        self._speed.zero_()
        wp.launch(
            kernels.watch,
            dim=model.n_vert,
            inputs=[self._time, model.vert_body, self._world, model.body_edge, model.inv_mass]
            + [self._anchor, state.x, state.v],
            outputs=[self._moved, self._speed],
        )
        wp.launch(
            kernels.begin_rest,
            dim=model.n_vert,
            inputs=[model.vert_body, self._moved, state.x],
            outputs=[self._anchor],
        )
        gravity = float(np.linalg.norm(model.gravity))
        wp.launch(
            kernels.count_rest,
            dim=model.n_body,
            inputs=[self._wanted, self._time, gravity, self._world, model.body_edge, self._moved]
            + [self._speed],
            outputs=[self._frames, self.awake.bodies, self._reach],
        )

    def _pause(self, work: Work) -> None:
        """Let bodies sleep, and have the pairs found again."""
        self._turns.sleep(self._before)
        work.broad_phase.stale.fill_(1)

    def _wake(self, work: Work) -> None:
        broad = work.broad_phase
        self._again.zero_()
        wp.launch(
            kernels.wake_island,
            dim=self.model.n_body,
            inputs=[broad.bodies.id, self.model.body_world, broad.lower, broad.upper, self._mobile],
            outputs=[self.awake.bodies, self._again],
        )
        if work.ties:
            wake_attached(self._mobile, self.awake.bodies, self._again, work)

    def _skip_frame(self, state: State, work: Work) -> None:
        state.v.zero_()
        self.awake.inv_mass.zero_()
        work.contacts.n.zero_()
        work.contacts.kept.n.fill_(-1)
        work.forces.unsolved.zero_()

    def begin_frame(self, state: State, work: Work) -> None:
        """Stop sleeping bodies, and forget the contact forces of all others."""
        model, awake = self.model, self.awake
        work.forces.unsolved.zero_()
        self._idle.assign(self._turns.idle[self._turns.worlds.of_body].astype(np.int32))
        wp.launch(
            kernels.pause_vertices,
            dim=model.n_vert,
            inputs=[model.vert_body, model.inv_mass, self._turns.inv_mass, awake.bodies]
            + [self._idle],
            outputs=[awake.inv_mass, state.v, work.forces.received],
        )
        wp.launch(
            kernels.clear_pairs,
            dim=work.forces.pair_key.shape[0],
            inputs=[awake.bodies],
            outputs=[work.forces.pair_key, work.forces.pair_total],
        )
