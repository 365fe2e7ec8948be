"""Heights of a surface above given points, for surfaces that face up or down."""

import numpy as np


def facing(x: np.ndarray, tris: np.ndarray, up: float) -> np.ndarray:
    """The triangles whose rest normals are along z, up (1) or down (-1), shape (k, 3)."""
    a, b, c = np.moveaxis(x[tris], 1, 0)
    n = np.cross(b - a, c - a)
    return tris[up * n[:, 2] > 0.9 * np.linalg.norm(n, axis=1)]


def height(points: np.ndarray, x: np.ndarray, tris: np.ndarray, slack=1e-3) -> np.ndarray:
    """Height [m] of a surface at the (x, y) of each point; nan beside it. Shape (n,)."""
    a, b, c = (x[tris[:, k]].astype(float) for k in range(3))
    u, v = (b - a)[:, :2], (c - a)[:, :2]
    d = points[:, None, :2].astype(float) - a[:, :2]  # (n, k, 2)
    whole = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    s = (d[..., 0] * v[:, 1] - d[..., 1] * v[:, 0]) / whole
    t = (u[:, 0] * d[..., 1] - u[:, 1] * d[..., 0]) / whole
    least = np.minimum(np.minimum(s, t), 1.0 - s - t)
    best = least.argmax(axis=1)
    row = np.arange(len(points))
    s, t = s[row, best], t[row, best]
    z = a[best, 2] + s * (b - a)[best, 2] + t * (c - a)[best, 2]
    return np.where(least[row, best] >= -slack, z, np.nan)
