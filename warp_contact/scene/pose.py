"""Where a body is, as a rotation and a translation of its mesh."""

import numpy as np


def pose_of(x: np.ndarray, rest: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Translation [m] and quaternion (x, y, z, w) that take ``rest`` nearest to ``x``, both (n, 3).

    Nearest by the squares of distances, weighted with the ``mass`` of each vertex [kg]
    (Kabsch 1976).
    """
    c, c0 = (np.average(y, axis=0, weights=mass) for y in (x, rest))
    u, _, vt = np.linalg.svd((mass[:, None] * (x - c)).T @ (rest - c0))
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return c - turn @ c0, quaternion(turn)


def quaternion(turn: np.ndarray) -> np.ndarray:
    """The quaternion (x, y, z, w), w >= 0, of a rotation matrix."""
    # The eigenvector of the largest eigenvalue, which is 1 (Bar-Itzhack 2000).
    (a, b, c), (d, e, f), (g, h, i) = turn
    k = [[a - e - i, d + b, g + c, h - f], [d + b, e - a - i, h + f, c - g]]
    k += [[g + c, h + f, i - a - e, d - b], [h - f, c - g, d - b, a + e + i]]
    q = np.linalg.eigh(np.array(k) / 3.0)[1][:, -1]
    return np.where(q[3] < 0.0, -q, q)


def rigid_motion_of(
    x: np.ndarray, v: np.ndarray, mass: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Velocity [m/s] of the centre of mass and angular velocity [rad/s], each of shape (3,).

    Those of a rigid body at ``x`` (n, 3) with the momenta of the velocities ``v`` (n, 3).
    """
    x, v = x.astype(np.float64), v.astype(np.float64)
    r, mean = x - np.average(x, axis=0, weights=mass), np.average(v, axis=0, weights=mass)
    inertia = (mass * (r * r).sum(axis=1)).sum() * np.eye(3) - (mass[:, None] * r).T @ r
    return mean, np.linalg.solve(inertia, (mass[:, None] * np.cross(r, v)).sum(axis=0))
