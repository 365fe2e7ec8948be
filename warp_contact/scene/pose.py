"""Where a body is, as a rotation and a translation of its mesh, and how it moves as a whole."""

import numpy as np

from warp_contact.data.model import Solid


def pose_of(x: np.ndarray, rest: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Translation [m] and quaternion (x, y, z, w) that take ``rest`` nearest to ``x``, both (n, 3).

    Nearest by the squares of distances, weighted with the ``mass`` of each vertex [kg]
    (Kabsch 1976). NaN where ``x`` is not finite.
    """
    if not np.isfinite(x).all():
        return np.full(3, np.nan), np.full(4, np.nan)
    place, turn = frame_of(x, rest, mass)
    return place, quaternion(turn)


def frame_of(x: np.ndarray, rest: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same with the rotation as a matrix, shape (3, 3)."""
    c, c0 = (np.average(y, axis=0, weights=mass) for y in (x, rest))
    u, _, vt = np.linalg.svd((mass[:, None] * (x - c)).T @ (rest - c0))
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return c - turn @ c0, turn


def quaternion(turn: np.ndarray) -> np.ndarray:
    """The quaternion (x, y, z, w), w >= 0, of a rotation matrix."""
    # The eigenvector of the largest eigenvalue, which is 1 (Bar-Itzhack 2000).
    (a, b, c), (d, e, f), (g, h, i) = turn
    k = [[a - e - i, d + b, g + c, h - f], [d + b, e - a - i, h + f, c - g]]
    k += [[g + c, h + f, i - a - e, d - b], [h - f, c - g, d - b, a + e + i]]
    q = np.linalg.eigh(np.array(k) / 3.0)[1][:, -1]
    return np.where(q[3] < 0.0, -q, q)


def centre_of(x: np.ndarray, rest: np.ndarray, mass: np.ndarray, solid: Solid | None) -> np.ndarray:
    """Centre of mass [m], shape (3,): that of the vertices, if the body is no ``solid``."""
    if solid is None:
        return np.average(x, axis=0, weights=mass)
    place, turn = frame_of(x.astype(np.float64), rest, mass)
    return place + turn @ solid.centre


def rigid_motion_of(
    x: np.ndarray, v: np.ndarray, mass: np.ndarray, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Velocity [m/s] at the point ``at`` and angular velocity [rad/s], each of shape (3,).

    Those of rigid vertices at ``x`` (n, 3) with the momenta of the velocities ``v`` (n, 3).
    """
    x, v = x.astype(np.float64), v.astype(np.float64)
    middle, mean = (np.average(y, axis=0, weights=mass) for y in (x, v))
    r = x - middle
    inertia = (mass * (r * r).sum(axis=1)).sum() * np.eye(3) - (mass[:, None] * r).T @ r
    w = np.linalg.solve(inertia, (mass[:, None] * np.cross(r, v)).sum(axis=0))
    return mean + np.cross(w, at - middle), w
