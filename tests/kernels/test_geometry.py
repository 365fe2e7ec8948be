"""kernels/geometry.py against NumPy in double precision."""

import numpy as np
import pytest
import warp as wp

from warp_contact.kernels import geometry
from warp_contact.kernels.broad_phase import edges

N = wp.constant(2000)
# Inputs of order 1 in float32, conditioned by the filters below: errors of a few hundred roundings.
TOL = 3e-5


@wp.kernel
def tet_weights(x: wp.array2d[wp.vec3], out: wp.array[wp.vec4]):
    i = wp.tid()
    out[i] = geometry.tet_weights(x[0, i], x[1, i], x[2, i], x[3, i], x[4, i])


@wp.kernel
def segment_hit(x: wp.array2d[wp.vec3], out: wp.array[wp.vec3]):
    i = wp.tid()
    out[i] = geometry.segment_hit(x[0, i], x[1, i], x[2, i], x[3, i], x[4, i], geometry.PARALLEL)


@wp.kernel
def triangle_closest(x: wp.array2d[wp.vec3], out: wp.array[wp.vec3]):
    i = wp.tid()
    out[i] = geometry.triangle_closest(x[0, i], x[1, i], x[2, i], x[3, i])


@wp.kernel
def lines_closest(x: wp.array2d[wp.vec3], out: wp.array[wp.vec2]):
    i = wp.tid()
    out[i] = geometry.lines_closest(x[0, i], x[1, i], x[2, i], x[3, i])


@wp.kernel
def projected_weights(x: wp.array2d[wp.vec3], out: wp.array[wp.vec3]):
    i = wp.tid()
    out[i] = geometry.projected_weights(x[0, i], x[1, i], x[2, i], x[3, i], x[4, i])


@wp.kernel
def projected_crossing(x: wp.array2d[wp.vec3], out: wp.array[wp.vec2]):
    i = wp.tid()
    out[i] = geometry.projected_crossing(x[0, i], x[1, i], x[2, i], x[3, i], x[4, i])


@wp.kernel
def gap_to(x: wp.array[wp.vec3], enough: float, out: wp.array[float]):
    i = wp.tid()
    t = wp.vec3i(2 * N + i, 3 * N + i, 4 * N + i)
    out[i] = edges.gap_to(x[i], x[N + i], t, enough, x)


def run(kernel, x: np.ndarray, dtype) -> np.ndarray:
    out = wp.zeros(x.shape[1], dtype=dtype)
    wp.launch(kernel, dim=x.shape[1], inputs=[wp.array(x, dtype=wp.vec3)], outputs=[out])
    return out.numpy()


def points(rng, rows: int) -> np.ndarray:
    """Rounded to float32, so that reference and kernel see the same numbers."""
    return rng.uniform(-1.0, 1.0, (rows, N, 3)).astype(np.float32).astype(float)


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...i->...", a, b)


def test_tet_weights_solve_the_barycentric_equations(rng):
    x = points(rng, 5)
    edges = np.swapaxes(x[2:] - x[1], 0, 1).swapaxes(1, 2)
    det = np.linalg.det(edges)
    x, edges = x[:, det > 0.05], edges[det > 0.05]
    w = np.linalg.solve(edges, (x[0] - x[1])[:, :, None])[:, :, 0]
    got = run(tet_weights, x, wp.vec4)
    # Weights grow with 1 / det, up to 20 here.
    np.testing.assert_allclose(got[:, 1:], w, rtol=0.0, atol=20.0 * TOL)
    np.testing.assert_allclose(got.sum(axis=1), 1.0, rtol=0.0, atol=20.0 * TOL)


def test_an_inverted_tet_holds_nothing(rng):
    x = points(rng, 5)
    det = dot(x[2] - x[1], np.cross(x[3] - x[1], x[4] - x[1]))
    np.testing.assert_array_equal(run(tet_weights, x[:, det < -1e-4], wp.vec4), -1.0)


def reference_hits(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    p, u, a, b, c = x
    system = np.stack([u, a - b, a - c], axis=2)
    det = np.linalg.det(system)
    solvable = np.abs(det) > 0.1
    solution = np.linalg.solve(system[solvable], (a - p)[solvable][:, :, None])[:, :, 0]
    return solvable, solution


def test_a_segment_hits_a_triangle_where_the_linear_system_says(rng):
    x = points(rng, 5)
    solvable, ref = reference_hits(x)
    got = run(segment_hit, x[:, solvable], wp.vec3)
    margin = np.minimum(ref[:, 1:].min(axis=1), 1.0 - ref[:, 1] - ref[:, 2])
    hit = got[:, 0] < 1e29
    sure = np.abs(margin) > 1e-3
    np.testing.assert_array_equal(hit[sure], margin[sure] > 0.0)
    assert 20 < hit.sum() < len(hit) - 20
    np.testing.assert_allclose(got[hit], ref[hit], rtol=0.0, atol=20.0 * TOL)


def test_a_segment_through_a_common_edge_hits_one_of_the_two_triangles_at_least(rng):
    p, u, a, b, c, d = points(rng, 6)
    s = rng.uniform(0.01, 0.99, (N, 1))
    u = a + s * (b - a) - p
    # Keep what is not seen edge-on.
    flat = [np.abs(dot(u, np.cross(b - a, e - a))) for e in (c, d)]
    keep = np.minimum(*flat) > 0.1
    one = run(segment_hit, np.stack([p, u, a, b, c])[:, keep], wp.vec3)
    two = run(segment_hit, np.stack([p, u, b, a, d])[:, keep], wp.vec3)
    assert (np.minimum(one[:, 0], two[:, 0]) < 2.0).all()


def test_a_segment_in_the_plane_of_a_triangle_is_no_hit(rng):
    p, _, a, b, c = points(rng, 5)
    p[..., 2] = a[..., 2] = b[..., 2] = c[..., 2] = 0.5
    got = run(segment_hit, np.stack([p, a - p, a, b, c]), wp.vec3)
    np.testing.assert_array_equal(got[:, 0], np.float32(1e30))


def closest_distance(x, a, b, c) -> np.ndarray:
    """Least of the three edges and, where the foot is inside, the plane."""
    best = np.full(len(x), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        t = np.clip(dot(x - p, q - p) / dot(q - p, q - p), 0.0, 1.0)[:, None]
        best = np.minimum(best, np.linalg.norm(p + t * (q - p) - x, axis=1))
    n = np.cross(b - a, c - a)
    inside = np.all(
        [dot(n, np.cross(q - p, x - p)) >= 0.0 for p, q in ((a, b), (b, c), (c, a))], axis=0
    )
    height = np.abs(dot(x - a, n)) / np.linalg.norm(n, axis=1)
    return np.where(inside, np.minimum(best, height), best)


def test_the_closest_point_of_a_triangle_is_the_least_of_its_features(rng):
    x, a, b, c = points(rng, 4)
    x *= 2.0
    fat = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0.1
    x, a, b, c = (y[fat] for y in (x, a, b, c))
    w = run(triangle_closest, np.stack([x, a, b, c]), wp.vec3).astype(float)
    # Weights of an inner point are quotients of cancelling products: errors grow like 1 / area^2.
    np.testing.assert_allclose(w.sum(axis=1), 1.0, rtol=0.0, atol=TOL)
    assert w.min() >= 0.0
    at = w[:, :1] * a + w[:, 1:2] * b + w[:, 2:] * c
    np.testing.assert_allclose(
        np.linalg.norm(at - x, axis=1), closest_distance(x, a, b, c), rtol=0.0, atol=10.0 * TOL
    )
    kinds = {tuple(row) for row in (w == 0.0).tolist()}
    assert len(kinds) == 7  # three corners, three edges, the inside: all were tried


def test_closest_points_of_two_lines_span_their_common_perpendicular(rng):
    x = points(rng, 4)
    p, q, a, b = x
    d1, d2 = q - p, b - a
    sine = np.linalg.norm(np.cross(d1, d2), axis=1)
    x, p, a, d1, d2 = x[:, sine > 0.3], *(y[sine > 0.3] for y in (p, a, d1, d2))
    s, u = run(lines_closest, x, wp.vec2).astype(float).T[:, :, None]
    gap = a + u * d2 - p - s * d1
    # Parameters are good to some roundings over sin^2 > 0.03.
    np.testing.assert_allclose(dot(gap, d1), 0.0, atol=30.0 * TOL)
    np.testing.assert_allclose(dot(gap, d2), 0.0, atol=30.0 * TOL)


def test_parallel_lines_have_no_closest_points(rng):
    p, q, a, _ = points(rng, 4)
    scale = rng.choice([-2.0, 0.5, 1.0, 4.0], (N, 1))
    got = run(lines_closest, np.stack([p, q, a, a + scale * (q - p)]), wp.vec2)
    np.testing.assert_array_equal(got, -1.0)


def test_projected_weights_put_the_point_on_the_line_along_the_normal(rng):
    x, n, a, b, c = points(rng, 5)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    seen = np.abs(dot(n, np.cross(b - a, c - a))) > 0.2
    x, n, a, b, c = (y[seen] for y in (x, n, a, b, c))
    w = run(projected_weights, np.stack([x, n, a, b, c]), wp.vec3).astype(float)
    at = w[:, :1] * a + w[:, 1:2] * b + w[:, 2:] * c
    np.testing.assert_allclose(w.sum(axis=1), 1.0, rtol=0.0, atol=10.0 * TOL)
    # Weights reach 60 for points far beside the triangle.
    np.testing.assert_allclose(np.cross(at - x, n), 0.0, atol=10.0 * TOL)


def test_projected_lines_cross_along_the_normal(rng):
    p, q, a, b, n = points(rng, 5)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    seen = np.abs(dot(n, np.cross(q - p, b - a))) > 0.2
    p, q, a, b, n = (y[seen] for y in (p, q, a, b, n))
    s, u = run(projected_crossing, np.stack([p, q, a, b, n]), wp.vec2).astype(float).T[:, :, None]
    gap = a + u * (b - a) - p - s * (q - p)
    # Parameters reach 60 where the lines cross far outside.
    np.testing.assert_allclose(np.cross(gap, n), 0.0, atol=10.0 * TOL)


@pytest.mark.parametrize("n", [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
def test_what_cannot_be_projected_gets_the_middle(n):
    a, b, c = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    x = np.array([(0.2, 0.3, 1.0), n, a, b, c])[:, None]
    np.testing.assert_allclose(run(projected_weights, x, wp.vec3), 1.0 / 3.0, rtol=1e-6)  # rounding
    parallel = np.array([a, b, c, (1.0, 1.0, 0.0), n])[:, None]
    np.testing.assert_array_equal(run(projected_crossing, parallel, wp.vec2), 0.5)


def test_a_segment_and_a_triangle_that_are_apart_have_a_gap_no_larger_than_their_distance(rng):
    x = points(rng, 5)
    p, q, a, b, c = x
    solvable, ref = reference_hits(np.array([p, q - p, a, b, c]))
    v, w = ref[:, 1:].T
    inside = np.min([ref[:, 0], 1.0 - ref[:, 0], v, w, 1.0 - v - w], axis=0)
    gaps = wp.zeros(len(p), dtype=float)
    flat = wp.array(x.reshape(-1, 3), dtype=wp.vec3)
    for enough in (1e30, 0.1):  # then axes are left out once one has shown so much
        wp.launch(gap_to, dim=len(p), inputs=[flat, enough], outputs=[gaps])
        gap = gaps.numpy()[solvable]
        crossed, apart = inside > 1e-2, inside < -1e-2
        assert crossed.sum() > 20 and apart.sum() > 20
        assert (gap[crossed] <= TOL).all() and (gap[apart] > 0.0).all()
    along = np.linspace(0.0, 1.0, 11)[:, None, None]
    on_segment = ((1.0 - along) * p + along * q)[:, solvable]
    weights = np.array([(i, j, 10 - i - j) for i in range(11) for j in range(11 - i)]) / 10.0
    on_triangle = np.einsum("kc,cni->kni", weights, x[2:, solvable])
    near = np.min([np.linalg.norm(on_triangle - s, axis=2).min(axis=0) for s in on_segment], axis=0)
    assert (gap[apart] <= near[apart] + TOL).all()
