"""Gravity and friction, which a user may change between two frames."""

import numpy as np

from warp_contact.data.model import Model


class Surroundings:
    """Changes them in place, where kernels and captured graphs read them.

    Attributes:
        first: those of the scene: gravity [m/s^2], then the coefficients of ``Model.friction``
    """

    def __init__(self, model: Model):
        """Keep those of the scene."""
        self._model = model
        self.first = tuple(model.gravity.tolist()), tuple(model.friction.numpy().tolist())

    def set_gravity(self, gravity: np.ndarray) -> None:
        """Set it [m/s^2], shape (3,)."""
        self._model.gravity[:] = gravity
        self._model.g.assign(self._model.gravity[None])

    def set_friction(self, index: int, friction: float) -> None:
        """Set the coefficient of a body, or of plane p at n_body + p."""
        self._model.friction[index : index + 1].fill_(friction)

    def values(self) -> dict[str, np.ndarray]:
        """What a checkpoint needs."""
        return {"gravity": self._model.gravity.copy(), "friction": self._model.friction.numpy()}

    def restore(self, gravity, friction) -> None:
        """Take over what ``values`` gave."""
        self.set_gravity(gravity)
        self._model.friction.assign(friction)

    def reset(self) -> None:
        """Put those of the scene back."""
        gravity, friction = self.first
        self.restore(gravity, np.array(friction, dtype=np.float32))
