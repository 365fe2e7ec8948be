"""How the rigid bodies of a scene move, by their own mass, centre and inertia."""

from dataclasses import dataclass

import numpy as np

from warp_contact.data.model import Model


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
        bodies = np.array([b for b, solid in enumerate(model.solids) if solid], dtype=int)
        solids = [model.solids[b] for b in bodies]
        start = model.body_vert.numpy()
        counts = np.diff(start)[bodies]
        self._of_vert = np.repeat(np.arange(len(bodies)), counts)
        self._first = np.cumsum(counts) - counts
        self.vertices = np.flatnonzero(np.isin(model.vert_body.numpy(), bodies))
        self._weight = model.mass.numpy().astype(np.float64)[self.vertices, None]
        self._mass = np.array([solid.mass for solid in solids])
        centre = np.array([solid.centre for solid in solids]).reshape(-1, 3)
        self._inertia = np.array([solid.inertia for solid in solids]).reshape(-1, 3, 3)
        rest = model.rest[self.vertices]
        middle = self._mean(rest)
        self._rest, self._to_centre = rest - middle[self._of_vert], centre - middle

    def motion(self, x: np.ndarray, v: np.ndarray) -> Motion:
        """At positions [m] and velocities [m/s] of all vertices, shape (n_vert, 3), float64.

        NaN for a body that is not finite, or so collapsed that it has no moments of inertia.
        """
        x, v = x[self.vertices], v[self.vertices]
        middle, v_m = self._mean(x), self._mean(v)
        r = x - middle[self._of_vert]
        mixed = self._mean(r[:, :, None] * self._rest[:, None])
        second = self._mean(r[:, :, None] * r[:, None])
        moments = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
        fit = np.isfinite(mixed).all(axis=(1, 2)) & (np.linalg.det(moments) > 0.0)
        mixed, moments = (np.where(fit[:, None, None], a, np.eye(3)) for a in (mixed, moments))
        u, _, vt = np.linalg.svd(mixed)
        u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
        turn = u @ vt
        w = np.linalg.solve(moments, self._mean(np.cross(r, v))[:, :, None])
        w[~fit] = np.nan
        arm = (turn @ self._to_centre[:, :, None])[:, :, 0]
        spin = turn @ self._inertia @ turn.swapaxes(1, 2) @ w
        w, spin = w[:, :, 0], spin[:, :, 0]
        return Motion(self._mass, middle + arm, v_m + np.cross(w, arm), w, spin)

    def _mean(self, values: np.ndarray) -> np.ndarray:
        """Weighted means over the vertices of each body."""
        weight = self._weight.reshape(-1, *np.ones(values.ndim - 1, dtype=int))
        total = np.add.reduceat(weight, self._first, axis=0)
        return np.add.reduceat(weight * values, self._first, axis=0) / total
