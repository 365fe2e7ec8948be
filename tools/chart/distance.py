"""The distance between two triangulated surfaces, from positions alone, in double precision.

The nearest points of two triangles that do not cross are a vertex and a point of a triangle, or a
point on an edge of each; where they cross, an edge of one goes through the other (Ericson 2005,
Real-Time Collision Detection, 5.1). Every pair is looked at, so surfaces had better be small.
"""

import numpy as np

PARALLEL = 1e-12  # determinant over the product of its terms below which it counts as zero


def distance(xa: np.ndarray, ta: np.ndarray, xb: np.ndarray, tb: np.ndarray) -> float:
    """Smallest distance [m] of two surfaces of vertices (n, 3) and triangles (m, 3).

    It is 0 where they cross; vertices that no triangle has do not count.
    """
    surfaces = (np.asarray(xa, dtype=float), ta), (np.asarray(xb, dtype=float), tb)
    a, b = ((x[np.unique(tris)], x[edges(tris)], x[tris]) for x, tris in surfaces)
    near = segments_segments(a[1], b[1])
    for (points, segments, _), (_, _, triangles) in ((a, b), (b, a)):
        start, end = segments[:, None, 0], segments[:, None, 1]
        low, high = over(start, triangles)[0], over(end, triangles)[0]
        through = low * high < 0.0
        at = low / np.where(through, low - high, 1.0)
        _, inside = over(start + at[..., None] * (end - start), triangles)
        if (through & inside).any():
            return 0.0
        # Points that face no inside are at best as near as an edge.
        height, inside = over(points[:, None], triangles)
        near = min(near, np.min(np.abs(height[inside]), initial=np.inf))
    return float(near)


def edges(tris: np.ndarray) -> np.ndarray:
    """Each edge of the triangles once, shape (k, 2)."""
    return np.unique(np.sort(tris[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)


def over(p: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of points, shape (n, 1 or m, 3), over each of m triangles: heights, and who faces it."""
    a, u, v = t[:, 0], t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
    n, d = np.cross(u, v), p - a
    area2 = _dot(n, n)
    s, r = _dot(np.cross(d, v), n) / area2, _dot(np.cross(u, d), n) / area2
    return _dot(d, n) / np.sqrt(area2), (s >= 0.0) & (r >= 0.0) & (s + r <= 1.0)


def segments_segments(p: np.ndarray, q: np.ndarray) -> float:
    """Smallest distance of segments, shapes (n, 2, 3) and (m, 2, 3)."""
    a, u = p[:, None, 0], (p[:, 1] - p[:, 0])[:, None]
    b, v = q[None, :, 0], (q[:, 1] - q[:, 0])[None]
    w = a - b
    uu, vv, uv, uw, vw = _dot(u, u), _dot(v, v), _dot(u, v), _dot(u, w), _dot(v, w)
    det = uu * vv - uv * uv
    lines = np.where(det > PARALLEL * uu * vv, det, np.inf)  # of parallel ones any point will do
    s = np.clip((uv * vw - vv * uw) / lines, 0.0, 1.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    return float(np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1).min())


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...i->...", a, b)
