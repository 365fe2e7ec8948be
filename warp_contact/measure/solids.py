"""How the rigid bodies of a scene move, by their own mass, centre and inertia."""

from dataclasses import dataclass

import numpy as np

from warp_contact.data.model import Model
from warp_contact.scene.pose import frame_of, rigid_motion_of


@dataclass(frozen=True)
class Motion:
    """Of all bodies that are rigid and move freely, in the world.

    Attributes:
        mass: [kg], shape (n,)
        centre: of mass [m], shape (n, 3)
        v, w: velocity of the centre [m/s] and angular velocity [rad/s], shape (n, 3)
        spin: angular momentum about the centre [kg m^2/s], shape (n, 3)
    """

    mass: np.ndarray
    centre: np.ndarray
    v: np.ndarray
    w: np.ndarray
    spin: np.ndarray

    @property
    def kinetic(self) -> float:
        """Energy [J]."""
        return 0.5 * float(self.mass @ (self.v**2).sum(axis=1) + (self.w * self.spin).sum())

    @property
    def momentum(self) -> np.ndarray:
        """Of all together [kg m/s], shape (3,)."""
        return self.mass @ self.v

    @property
    def angular_momentum(self) -> np.ndarray:
        """Of all together, about the origin [kg m^2/s], shape (3,)."""
        return (np.cross(self.centre, self.mass[:, None] * self.v) + self.spin).sum(axis=0)


class Solids:
    """The bodies of a model that are rigid and move freely."""

    def __init__(self, model: Model):
        """Read what stays constant."""
        start, mass = model.body_vert.numpy(), model.mass.numpy().astype(np.float64)
        self._bodies = []
        for body, solid in enumerate(model.solids):
            if solid:
                own = slice(start[body], start[body + 1])
                self._bodies.append((own, solid, model.rest[own], mass[own]))

    def __iter__(self):
        """The vertices of each, as slices."""
        return (own for own, *_ in self._bodies)

    def motion(self, x: np.ndarray, v: np.ndarray) -> Motion:
        """At positions [m] and velocities [m/s] of all vertices, shape (n_vert, 3), float64."""
        found = np.zeros((len(self._bodies), 4, 3))
        for row, (own, solid, rest, mass) in zip(found, self._bodies, strict=True):
            place, turn = frame_of(x[own], rest, mass)
            centre = place + turn @ solid.centre
            v_c, w = rigid_motion_of(x[own], v[own], mass, centre)
            row[:] = centre, v_c, w, turn @ solid.inertia @ turn.T @ w
        return Motion(
            np.array([solid.mass for _, solid, *_ in self._bodies]), *found.swapaxes(0, 1)
        )
