"""Forces and torques that the user lets act on bodies during a frame."""

import numpy as np

from warp_contact.data.implicit import Shapes
from warp_contact.data.model import Model
from warp_contact.data.state import State
from warp_contact.data.work import Work
from warp_contact.kernels.implicit.bodies import FREE, RIGID
from warp_contact.step.implicit import push


class Wrench:
    """Those of the last frame and of the next one.

    Velocities are half a step behind positions. A force that changes between two frames acts for
    half a step at its old value and half a step at its new one.
    """

    def __init__(self, shapes: Shapes | None):
        """Nothing acts; ``shapes`` hold what the kernels read, None where steps are explicit."""
        self._shapes = shapes
        n = len(shapes.kind) if shapes else 0
        self._last, self._next = np.zeros((2, 2, n, 3))

    def add(self, body: int, force: np.ndarray, torque: np.ndarray) -> None:
        """Let a force [N] and a torque [N m] act on body ``body`` in the next frame.

        Raises:
            ValueError: steps are explicit, or the body has fixed vertices
        """
        if not self._shapes:
            raise ValueError("apply goes with integrator='implicit'")
        if self._shapes.kind[body] not in (int(FREE), int(RIGID)):
            raise ValueError("it has fixed vertices: give them a velocity")
        self._next[:, body] += force, torque

    def begin(self, model: Model, state: State, work: Work) -> None:
        """Let what acts in the next frame replace what acted in the last one."""
        if self._shapes and (self._last != self._next).any():
            self._assign(self._last)
            push(model, state, work, 0.5)
            self._assign(self._next)
            push(model, state, work, -0.5)

    def finish(self) -> None:
        """End the frame."""
        self._last, self._next = self._next, np.zeros_like(self._next)

    def clear(self) -> None:
        """Nothing acts, as before the first frame."""
        self.restore(np.zeros_like(self._last))

    def values(self) -> dict[str, np.ndarray]:
        """What a checkpoint needs."""
        return {"last": self._last}

    def restore(self, last: np.ndarray) -> None:
        """Take over what ``values`` gave."""
        self._last, self._next = last, np.zeros_like(last)
        if self._shapes:
            self._assign(last)

    def _assign(self, wrench: np.ndarray) -> None:
        for array, values in zip((self._shapes.force, self._shapes.torque), wrench, strict=True):
            array.assign(values.astype(np.float32))
