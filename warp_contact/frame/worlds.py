"""The worlds of a scene: each takes the steps that it needs itself."""

import numpy as np

from warp_contact.data.model import Model


class WorldIds:
    """Numbers the worlds from 0 on, whatever the user called them.

    Attributes:
        n: how many there are
        of_body: number of the world of each body, shape (n_body,)
        of_vert: the same of each vertex, shape (n_vert,)
    """

    def __init__(self, model: Model, apart: bool = True):
        """With ``apart`` False all bodies count as one world."""
        named = model.body_world.numpy() if apart else np.zeros(model.n_body)
        names, of_body = np.unique(named, return_inverse=True)
        self.n, self.of_body = len(names), of_body
        self.of_vert = of_body[model.vert_body.numpy()]

    def most(self, of_bodies: np.ndarray) -> np.ndarray:
        """The largest value of the bodies of each world: (..., n_body) to (..., n)."""
        out = np.full((*of_bodies.shape[:-1], self.n), -np.inf)
        np.maximum.at(out, (..., self.of_body), of_bodies)
        return out
