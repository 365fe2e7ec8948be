"""apart.py: what separated an edge from triangles before, against all axes in NumPy."""

import numpy as np
import warp as wp

from warp_contact.kernels.narrow_phase.apart import Apart, pair_clearance

N = 400  # edges, each with TRIS triangles
TRIS = 3
ENOUGH = 1.0e3  # every axis counts
ROUNDING = 1e-6  # of coordinates of order 1 in float32


@wp.kernel
def clearances(
    x: wp.array[wp.vec3],
    tri: wp.array[int],
    tris: wp.array[wp.vec3i],
    apart: Apart,
    out: wp.array[float],
):
    i = wp.tid()
    among = wp.vec2i(TRIS * i, TRIS * i + TRIS)
    out[i] = pair_clearance(
        i, among, ENOUGH, tri, tris, x, x[3 * TRIS * N + i], x[3 * TRIS * N + N + i], apart
    )


def gaps(p: np.ndarray, q: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Largest gap between segments and triangles along any axis, shape (N, TRIS)."""
    a, b, c = t[:, :, 0], t[:, :, 1], t[:, :, 2]
    d = np.broadcast_to((q - p)[:, None], a.shape)
    n = np.cross(b - a, c - a)
    axes = [n, np.cross(n, d)]
    for e in (b - a, c - a, c - b):
        axes += [np.cross(d, e), np.cross(n, e)]
    best = np.full(a.shape[:2], -np.inf)
    for axis in axes:
        unit = axis / np.linalg.norm(axis, axis=-1, keepdims=True)
        of_edge = np.stack([((end[:, None] - a) * unit).sum(axis=-1) for end in (p, q)])
        of_tri = np.stack([((corner - a) * unit).sum(axis=-1) for corner in (a, b, c)])
        for low, high in ((of_tri, of_edge), (of_edge, of_tri)):
            best = np.maximum(best, high.min(axis=0) - low.max(axis=0))
    return best


def test_what_separated_an_edge_before_is_found_again_and_hides_no_crossing(rng):
    corners = 3 * TRIS * N
    x = np.concatenate([rng.uniform(-1.0, 1.0, (corners, 3)), rng.uniform(-1.0, 1.0, (2 * N, 3))])
    tri = wp.array(np.arange(TRIS * N), dtype=int)
    tris = wp.array(np.arange(corners).reshape(-1, 3), dtype=wp.vec3i)
    apart = Apart()
    apart.gap = wp.zeros(N, dtype=float)
    apart.axis = wp.zeros(TRIS * N, dtype=wp.int8)
    out = wp.zeros(N, dtype=float)
    crossings, kept = 0, 0
    for _ in range(40):
        before = apart.gap.numpy().copy()
        x += rng.normal(0.0, 0.02, x.shape)
        now = wp.array(x, dtype=wp.vec3)
        wp.launch(clearances, dim=N, inputs=[now, tri, tris, apart], outputs=[out])
        single = now.numpy().astype(float)
        p, q = single[corners : corners + N], single[corners + N :]
        exact = gaps(p, q, single[:corners].reshape(N, TRIS, 3, 3)).min(axis=1)
        found = out.numpy()
        assert (found[exact > ROUNDING] > 0.0).all()
        assert (found[exact < -ROUNDING] == 0.0).all()
        assert (found <= np.maximum(exact, 0.0) + ROUNDING).all()
        # No less than half of what was known, or what there is.
        assert (found >= np.minimum(0.5 * before, np.maximum(exact, 0.0)) - ROUNDING).all()
        crossings += (exact < 0.0).sum()
        kept += (found < exact - 1e-3).sum()
    assert crossings > 100
    assert kept > 100  # where another axis would have shown more
