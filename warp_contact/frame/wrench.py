"""Forces and torques that the user lets act on bodies during a frame."""

import numpy as np

from warp_contact.data.implicit import Shapes
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.step.implicit import push
from warp_contact.step.velocity import shift_velocities


class Wrench:
    """Those of the last frame and of the next one.

    Velocities are half a step behind positions. A force that changes between two frames acts for
    half a step at its old value and half a step at its new one.

    Attributes:
        driven: speed up to which a motor may bring bodies of each attachment [m/s], (n_attachment,)
    """

    def __init__(self, shapes: Shapes | None, model: Model):
        """Nothing acts; ``shapes`` hold what the kernels read, None where steps are explicit."""
        self._shapes, self._of_vert = shapes, model.vert_body.numpy()
        n = model.n_body
        self._mass = np.bincount(self._of_vert, model.mass.numpy(), n)
        moving = np.bincount(self._of_vert, model.inv_mass.numpy() > 0.0, n)
        self._fixed, self._held = moving == 0, moving < np.bincount(self._of_vert, minlength=n)
        self._last, self._next = np.zeros((2, 2, n, 3))
        self._kept = self._last, self._next
        self._joined = model.ties.body if model.ties else np.zeros((0, 2), dtype=int)
        self.driven = np.zeros(len(self._joined))

    def add(self, body: int, force: np.ndarray, torque: np.ndarray) -> None:
        """Let a force [N] and a torque [N m] act on body ``body`` in the next frame.

        Raises:
            ValueError: steps are explicit, or the body has fixed vertices
        """
        if self._fixed[body]:
            raise ValueError("it is fixed: give it a velocity")
        if not self._shapes:
            raise ValueError("apply goes with integrator='implicit'")
        if self._held[body]:
            raise ValueError("it has fixed vertices: give them a velocity")
        self._next[:, body] += force, torque

    def shift(self, model: Model, state: State, work: Work, lag: np.ndarray) -> None:
        """Shift velocities by ``lag`` [s], shape (n_vert,), while what acted last still acts."""
        self._kept = self._last, self._next
        if self._shapes:
            self._assign(self._last)
        shift_velocities(model, state, work, work.awake, lag)

    def gains(self, duration: float) -> np.ndarray:
        """Speed [m/s] that each body gains in a frame of ``duration`` [s] at most, (n_body,)."""
        led = np.zeros(len(self._mass) + 1)  # the last one is the world
        np.maximum.at(led, self._joined.ravel(), np.repeat(self.driven, 2))
        return duration * self._accelerations() + led[:-1]

    def _accelerations(self) -> np.ndarray:
        """How fast what acts in the next frame makes each body [m/s^2] at most, (n_body,)."""
        force, torque = np.linalg.norm(self._next, axis=2)
        if not self._shapes or not self._next.any():
            return force
        arm = np.zeros(len(force))
        np.maximum.at(arm, self._of_vert, np.linalg.norm(self._shapes.rest, axis=1))
        least = np.linalg.eigvalsh(self._shapes.inertia)[:, 0]
        turns = np.divide(torque * arm, least, out=np.zeros(len(force)), where=torque > 0.0)
        return force / self._mass + turns

    def begin(self, model: Model, state: State, work: Work) -> None:
        """Let what acts in the next frame replace what acted in the last one."""
        if self._shapes and (self._last != self._next).any():
            push(model, state, work, 0.5)
            self._assign(self._next)
            push(model, state, work, -0.5)

    def finish(self) -> None:
        """End the frame."""
        self._last, self._next = self._next, np.zeros_like(self._next)

    def undo(self) -> None:
        """Leave all as if the frame had not begun; what was to act in it, still is."""
        self._last, self._next = self._kept
        if self._shapes:
            self._assign(self._last)

    def forget(self, bodies: np.ndarray) -> None:
        """Nothing is to act on bodies, a mask, in the next frame."""
        self._next[:, bodies] = 0.0

    def clear(self) -> None:
        """Nothing acts, as before the first frame."""
        nothing = np.zeros((2, *self._last.shape))
        self.restore(nothing[0], nothing[1], np.zeros(len(self.driven)))

    def values(self) -> dict[str, np.ndarray]:
        """What a checkpoint needs."""
        return {"last": self._last, "next": self._next, "driven": self.driven}

    def restore(self, last: np.ndarray, following: np.ndarray, driven: np.ndarray) -> None:
        """Take over what ``values`` gave."""
        self._last, self._next, self.driven = last, following, driven.copy()
        if self._shapes:
            self._assign(last)

    def _assign(self, wrench: np.ndarray) -> None:
        for array, values in zip((self._shapes.force, self._shapes.torque), wrench, strict=True):
            array.assign(values.astype(np.float32))
