"""kernels/surface/region.py: displacement vectors of eq. (1) and the tets they touch."""

import numpy as np

from warp_contact import NeoHookean, Scene, box
from warp_contact.kernels.lengths import CLOSURE_TOLERANCE
from warp_contact.step import residual, search

RUBBER = NeoHookean(1e5, 0.3, 1000.0)


def region(scene: Scene, stages, find_contacts, records, edges: bool = False) -> tuple:
    """Stages 1 to 3 at the initial positions: model, work, contact records."""
    model, state, work = stages(scene)
    find_contacts(model, work, state.x, edges=edges)
    residual.find_gaps(model, state.x, work)
    search.begin(model, state.x, work, work.surface.open)
    return model, work, records(work)


def displacements(c, n_vert: int) -> np.ndarray:
    """Eq. (1) contact by contact: s = (d - sum w_i d_i) / (sum w_i + 1)."""
    own, own_weight = np.zeros((n_vert, 3)), np.zeros(n_vert)
    pushed, weight = np.zeros((n_vert, 3)), np.zeros(n_vert)
    for vert, coef, normal, depth in zip(c.vert, c.coef, c.normal, c.residual, strict=True):
        if depth > 0.0:
            for k in range(5):
                w, i = abs(float(coef[k])), vert[k]
                if k < 2:
                    own[i] += w * depth * normal
                    own_weight[i] += w
                else:
                    pushed[i] += w * depth * normal
                    weight[i] += w
    d = own / np.maximum(own_weight, 1.0)[:, None]  # a vertex in several bodies: their mean
    return (d - pushed) / (weight + 1.0)[:, None]


def test_displacement_vectors_are_those_of_eq_1(
    rng, stages, find_contacts, records, jittered, turned
):
    scene = Scene()
    for place in rng.uniform(-0.4, 0.4, (3, 3)):
        scene.add_body(jittered(1.0, 3), RUBBER, place, turned())
    model, work, c = region(scene, stages, find_contacts, records, edges=True)
    s = work.surface.s.numpy()
    assert (np.linalg.norm(s, axis=1) > 0.0).sum() > 20
    # Sums of tens of terms of order 1 in float32.
    np.testing.assert_allclose(s, displacements(c, model.n_vert), rtol=0.0, atol=5e-6)


def test_overlap_left_is_the_gap_of_the_records(rng, stages, find_contacts, records, jittered):
    scene = Scene()
    scene.add_plane((0.0, 0.6, 0.8), -0.2)
    for place in rng.uniform(-0.3, 0.3, (2, 3)):
        scene.add_body(jittered(1.0, 2), RUBBER, place)
    model, work, c = region(scene, stages, find_contacts, records)
    x = work.x.numpy().astype(float)
    gap = np.einsum("ck,cki,ci->c", c.coef, x[c.vert], c.normal) - c.offset
    used = (c.coef != 0.0).any(axis=1)
    assert (c.pair[used, 1] == model.n_body).any()
    least = CLOSURE_TOLERANCE * model.body_edge.numpy()[c.pair[:, 0]]
    # Coordinates of order 1 in float32.
    counted, too_small = used & (-gap > least + 1e-6), used & (-gap < least - 1e-6)
    np.testing.assert_allclose(c.residual[counted], -gap[counted], atol=1e-6)
    np.testing.assert_array_equal(c.residual[too_small], 0.0)
    off = np.abs(c.residual[counted] - c.depth[counted])
    # A ray from just inside the body may leave beside that of the vertex: a tenth in the weights.
    assert np.median(off) < 1e-5 and off.max() < 0.1 * model.body_edge.numpy().max()


def test_matching_vertices_both_get_the_whole_depth(stages, find_contacts, records):
    # Vertex on vertex: w = 1 and d_i = -d, so s = (d + d) / (1 + 1).
    depth = 0.1
    scene = Scene()
    for z in (0.0, 1.0 - depth):
        scene.add_body(box(1.0, 2), RUBBER, (0.0, 0.0, z))
    _, work, _ = region(scene, stages, find_contacts, records)
    s, z = work.surface.s.numpy(), work.x.numpy()[:, 2]
    # The rim of one block lies in the sides of the other: only the inner vertex is sure to be found
    # with its own direction along z.
    for side, sign in ((z > 0.49) & (z < 0.51), -1.0), ((z > 0.39) & (z < 0.41), 1.0):
        xy = work.x.numpy()[side, :2]
        middle = np.abs(xy).max(axis=1) < 0.1
        np.testing.assert_allclose(s[side][middle], [[0.0, 0.0, sign * depth]], atol=1e-6)


def test_a_triangle_gives_way_by_its_weights_and_fixed_vertices_by_nothing(
    stages, find_contacts, records
):
    scene = Scene()
    wide = box((2.0, 2.0, 1.0), 1)
    scene.add_body(wide, RUBBER, (0.0, 0.0, -0.5), fixed=[7])
    scene.add_body(box(0.2, 1), RUBBER, (0.3, 0.1, 0.1 - 0.01))
    model, work, c = region(scene, stages, find_contacts, records)
    s = work.surface.s.numpy()
    np.testing.assert_array_equal(s[7], 0.0)
    free = displacements(c, model.n_vert)
    top = np.flatnonzero((wide.vertices[:, 2] > 0.0) & (np.arange(8) != 7))
    np.testing.assert_allclose(s[top], free[top], atol=1e-7)
    assert (s[top, 2] < 0.0).any() and (s[8:, 2] >= 0.0).all()


def test_the_mask_holds_the_tets_that_touch_the_region(
    rng, stages, find_contacts, records, jittered
):
    scene = Scene()
    for z in (0.0, 0.9):
        scene.add_body(jittered(1.0, 4), RUBBER, (0.0, 0.0, z))
    model, work, _ = region(scene, stages, find_contacts, records)
    moving = np.linalg.norm(work.surface.s.numpy(), axis=1) > 0.0
    mask = work.surface.mask.numpy()
    np.testing.assert_array_equal(mask == 1, moving[model.tets.numpy()].any(axis=1))
    assert 0 < mask.sum() < model.n_tet
