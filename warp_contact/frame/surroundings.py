"""Gravity, friction and restitution, which a user may change between two frames."""

import numpy as np

from warp_contact.data.model import Model


class Surroundings:
    """Changes them in place, where kernels and captured graphs read them.

    Attributes:
        first: those of the scene: gravity [m/s^2], then the coefficients of ``Model.friction``
            and those of ``Model.restitution``
    """

    def __init__(self, model: Model):
        """Keep those of the scene."""
        self._model = model
        both = model.friction, model.restitution
        self.first = tuple(model.gravity.tolist()), *(tuple(c.numpy().tolist()) for c in both)

    def set_gravity(self, gravity: np.ndarray) -> None:
        """Set it [m/s^2], shape (3,)."""
        self._model.gravity[:] = gravity
        self._model.g.assign(self._model.gravity[None])

    def set_coefficient(self, name: str, index: int, value: float) -> None:
        """Set ``friction`` or ``restitution`` of a body, or of plane p at n_body + p."""
        getattr(self._model, name)[index : index + 1].fill_(value)

    def values(self) -> dict[str, np.ndarray]:
        """What a checkpoint needs."""
        m = self._model
        both = {"friction": m.friction.numpy(), "restitution": m.restitution.numpy()}
        return {"gravity": m.gravity.copy()} | both

    def restore(self, gravity, friction, restitution) -> None:
        """Take over what ``values`` gave."""
        self.set_gravity(gravity)
        self._model.friction.assign(friction)
        self._model.restitution.assign(restitution)

    def reset(self) -> None:
        """Put those of the scene back."""
        gravity, *both = self.first
        self.restore(gravity, *(np.array(first, dtype=np.float32) for first in both))
