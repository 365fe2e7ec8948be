"""The distance between two triangulated surfaces, from positions alone, in double precision.

The nearest points of two triangles that do not cross are a vertex and a point of a triangle, or a
point on an edge of each; where they cross, an edge of one goes through the other (Ericson 2005,
Real-Time Collision Detection, 5.1). Every pair is looked at, so surfaces had better be small.
"""

import numpy as np

PARALLEL = 1e-12  # determinant over the product of its terms below which it counts as zero


def distance(xa: np.ndarray, ta: np.ndarray, xb: np.ndarray, tb: np.ndarray) -> float:
    """Smallest distance [m] of two surfaces; 0 where they cross.

    Args:
        xa: vertices of the first [m], shape (n, 3); those that no triangle has do not count
        ta: its triangles, shape (m, 3)
        xb: vertices of the second
        tb: its triangles
    """
    xa, xb = np.asarray(xa, dtype=float), np.asarray(xb, dtype=float)
    ea, eb = edges(ta), edges(tb)
    if crosses(xa[ea], xb[tb]) or crosses(xb[eb], xa[ta]):
        return 0.0
    return min(
        points_triangles(xa[np.unique(ta)], xb[tb]),
        points_triangles(xb[np.unique(tb)], xa[ta]),
        segments_segments(xa[ea], xb[eb]),
    )


def edges(tris: np.ndarray) -> np.ndarray:
    """Each edge of the triangles once, shape (k, 2)."""
    return np.unique(np.sort(tris[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)


def points_triangles(p: np.ndarray, t: np.ndarray) -> float:
    """Smallest distance of points, shape (n, 3), and the insides of triangles, shape (m, 3, 3).

    Points that face no inside are at best as near as an edge: of ``segments_segments``.
    """
    a, u, v = t[:, 0], t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
    n = np.cross(u, v)
    area2 = _dot(n, n)
    d = p[:, None] - a
    s, r = _dot(np.cross(d, v), n) / area2, _dot(np.cross(u, d), n) / area2
    facing = (s >= 0.0) & (r >= 0.0) & (s + r <= 1.0)
    height = np.abs(_dot(d, n)) / np.sqrt(area2)
    return float(np.min(height[facing], initial=np.inf))


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


def crosses(p: np.ndarray, t: np.ndarray) -> bool:
    """Whether any segment, shape (n, 2, 3), goes through the inside of any triangle."""
    a, u, v = t[:, 0], t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
    n = np.cross(u, v)
    start, way = p[:, None, 0] - a, (p[:, 1] - p[:, 0])[:, None]
    from_plane, climb = _dot(start, n), _dot(way, n)
    ends = from_plane * (from_plane + climb) < 0.0
    s = -from_plane / np.where(ends, climb, 1.0)
    d = start + s[..., None] * way
    first, second = _dot(np.cross(d, v), n), _dot(np.cross(u, d), n)
    area2 = _dot(n, n)
    return bool((ends & (first > 0.0) & (second > 0.0) & (first + second < area2)).any())


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...i->...", a, b)
