"""search.py: the searches for equal pressure, as printed and balanced."""

import numpy as np
import pytest
import warp as wp

from warp_contact import ContactSurface, NeoHookean, Scene, Simulation, box
from warp_contact.step import forces, residual, search

EDGE = 0.1  # of a block [m]
OVERLAP = 1e-4  # [m]: small strains, but 1e4 roundings


def blocks(ratio: float, cells=(4, 4), overlap: float = OVERLAP, young: float = 1e5) -> Scene:
    """A block and one of ``ratio`` times its stiffness on top of it, as two springs in z."""
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for k, (stiff, n) in enumerate(zip((young, ratio * young), cells, strict=True)):
        z = (k - 0.5) * EDGE - k * overlap
        scene.add_body(box(EDGE, n), NeoHookean(stiff, 0.0, 1000.0), (0.0, 0.0, z))
    return scene


def searched(scene: Scene, stages, find_contacts, records, response: ContactSurface) -> tuple:
    model, state, work = stages(scene)
    find_contacts(model, work, state.x)
    residual.find_gaps(model, state.x, work)
    move = search.balance if response.search == "balanced" else search.bisect
    move(model, state.x, work, response.iterations)
    return model, state, work, records(work)


def inner(model, work) -> list[np.ndarray]:
    """Displacement vertices of each body away from the rim, where s is along z."""
    x = work.x.numpy()
    region = np.linalg.norm(work.surface.s.numpy(), axis=1) > 0.5 * OVERLAP
    region &= np.abs(x[:, :2]).max(axis=1) < 0.4 * EDGE
    return [np.flatnonzero(region & (model.vert_body.numpy() == body)) for body in (0, 1)]


@pytest.mark.parametrize("ratio", [1.0, 3.0, 10.0])
def test_balanced_shares_the_overlap_like_two_springs(stages, find_contacts, records, ratio):
    model, _, work, _ = searched(
        blocks(ratio), stages, find_contacts, records, ContactSurface("balanced")
    )
    lower, upper = inner(model, work)
    assert len(lower) == len(upper) == 9
    share = work.surface.fraction.numpy()
    # Strain 4e-3 in the cells at the surface, to whose order neo-Hookean is not linear.
    np.testing.assert_allclose(share[lower], ratio / (1.0 + ratio), atol=5e-3)
    np.testing.assert_allclose(share[upper], 1.0 / (1.0 + ratio), atol=5e-3)


# Not 3: its balance, 3/4, is a fraction that is tried, where each vertex' sign is left to rounding.
@pytest.mark.parametrize("ratio", [1.5, 2.0, 5.0, 10.0])
def test_literal_shares_the_overlap_within_its_last_step(stages, find_contacts, records, ratio):
    model, _, work, _ = searched(
        blocks(ratio), stages, find_contacts, records, ContactSurface("literal")
    )
    lower, upper = inner(model, work)
    share = work.surface.fraction.numpy()
    # Steps 1/4, 1/8, 1/16, 1/32: what is left is at most the last, and the strain as above.
    assert np.abs(share[lower] - ratio / (1.0 + ratio)).max() <= 1.0 / 32.0 + 5e-3
    assert np.abs(share[upper] - 1.0 / (1.0 + ratio)).max() <= 1.0 / 32.0 + 5e-3


@pytest.mark.parametrize("iterations", [3, 4, 16])
def test_a_side_that_is_pressed_already_yields_less_or_more(
    stages, find_contacts, records, iterations
):
    # a = (P0_upper - P0_lower + k) / 2 k with k = E overlap / cell: a quarter less for the lower.
    strain = 0.5 * OVERLAP / (0.25 * EDGE)
    model, state, work = stages(blocks(1.0))
    x = state.x.numpy().copy()
    lower = model.vert_body.numpy() == 0
    x[lower, 2] *= 1.0 - strain
    state.x.assign(x)
    find_contacts(model, work, state.x)
    residual.find_gaps(model, state.x, work)
    search.balance(model, state.x, work, iterations)
    left = 0.25 * 0.75 ** (iterations - 1)  # an imbalance is corrected by a quarter at a time
    share = work.surface.fraction.numpy()
    one, two = inner(model, work)
    assert len(one) == len(two) == 9
    # Nonlinear to the order of the strains of 4e-3; float32 forces at a strain of 2e-3.
    np.testing.assert_allclose(share[one], 0.25 + left, atol=0.02)
    np.testing.assert_allclose(share[two], 0.75 - left, atol=0.02)


def test_both_sides_of_the_balanced_search_meet(rng, stages, find_contacts, records, jittered):
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for k, cells in enumerate((4, 6)):
        material = NeoHookean(1e5 * rng.uniform(1.0, 5.0), 0.3, 1000.0)
        scene.add_body(jittered(EDGE, cells, 0.2), material, (0.0, 0.0, 0.95 * k * EDGE))
    _, _, work, c = searched(scene, stages, find_contacts, records, ContactSurface("balanced"))
    share = work.surface.fraction.numpy().astype(float)
    region = np.linalg.norm(work.surface.s.numpy(), axis=1) > 0.0
    up, lo = mean_over(c, [0, 1], share, region), mean_over(c, [2, 3, 4], share, region)
    total = (up + lo)[c.residual > 0.0]
    print(f"off by {np.abs(total - 1.0).mean():.3f}, {total.min():.3f} to {total.max():.3f}")
    assert len(total) > 20
    # Where the meshes do not match, interpolation to and fro leaves this much of an overlap.
    assert np.abs(total - 1.0).mean() < 0.075


@pytest.mark.parametrize("search_for", ["balanced", "literal"])
def test_a_triangle_that_is_partly_fixed_counts_by_its_free_vertices(
    rng, stages, find_contacts, records, jittered, search_for
):
    """What is fixed moves by nothing, and its pressure says nothing."""
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    for k, cells in enumerate((3, 4)):
        mesh = jittered(EDGE, cells, 0.2)
        held = rng.random(len(mesh.vertices)) < 0.4
        scene.add_body(mesh, NeoHookean(1e5, 0.3, 1000.0), (0.0, 0.0, 0.9 * k * EDGE), fixed=held)
    response = ContactSurface(search_for, iterations=4)
    model, state, work, c = searched(scene, stages, find_contacts, records, response)
    region = np.linalg.norm(work.surface.s.numpy(), axis=1) > 0.0
    fixed = model.inv_mass.numpy() == 0.0
    np.testing.assert_array_equal(state.x.numpy()[fixed], work.x.numpy()[fixed])
    # What the last pass saw of both sides. Where all are fixed there is a fraction of -1.
    value = work.surface.at_trial.numpy().astype(float)
    value[fixed] = np.nan  # not to be looked at
    mixed = 0
    for ks, means in (([0, 1], work.surface.upper_mean), ([2, 3, 4], work.surface.lower_mean)):
        w = np.abs(c.coef[:, ks]) * region[c.vert[:, ks]]
        seen = np.where(w > 0.0, value[c.vert[:, ks]], 0.0)
        some = w.sum(axis=1) > 0.0
        want = (w * seen).sum(axis=1)[some] / w.sum(axis=1)[some]
        found = means.numpy()[: c.n]
        size = np.abs(value[region]).max()
        np.testing.assert_allclose(found[some, 0], want, atol=1e-5 * size)  # rounding
        np.testing.assert_array_equal(found[~some, 2], -1.0)
        mixed += (some & (fixed[c.vert[:, ks]] & (c.coef[:, ks] != 0.0)).any(axis=1)).sum()
    assert mixed > 0


def nodal_forces(model, x: np.ndarray) -> np.ndarray:
    f_tet = wp.zeros(4 * model.n_tet, dtype=wp.vec3)
    ones = wp.full(model.n_tet, 1, dtype=int)
    forces.internal_forces(model, wp.array(x, dtype=wp.vec3), ones, f_tet)
    f = np.zeros((model.n_vert, 3))
    np.add.at(f, model.tets.numpy().ravel(), f_tet.numpy().reshape(-1, 3).astype(float))
    return f


def mean_over(c, ks, value, region) -> np.ndarray:
    """Mean of a vertex field over one side of each contact, by the weights in the region."""
    w = np.abs(c.coef[:, ks]) * region[c.vert[:, ks]]
    return (w * value[c.vert[:, ks]]).sum(axis=1) / np.maximum(w.sum(axis=1), 1e-30)


def literal_fractions(model, c, x0: np.ndarray, s: np.ndarray, iterations: int) -> np.ndarray:
    """Eq. (2) and the printed search in NumPy: nodal forces along s, one sign per vertex."""
    length = np.linalg.norm(s, axis=1)
    region = length > 0.0
    along = s / np.where(region, length, 1.0)[:, None]
    a = np.where(region, 0.5, 0.0)
    for k in range(iterations):
        own = -np.einsum("vi,vi->v", nodal_forces(model, x0 + a[:, None] * s), along)
        upper, lower = mean_over(c, [0, 1], own, region), mean_over(c, [2, 3, 4], own, region)
        touch, weight = np.zeros(len(a)), np.zeros(len(a))
        inside, inside_weight = np.zeros(len(a)), np.zeros(len(a))
        for j in np.flatnonzero(c.residual > 0.0):
            for m in range(5):
                i, w = c.vert[j, m], abs(c.coef[j, m])
                if m < 2:
                    inside[i] += w * lower[j]
                    inside_weight[i] += w
                else:
                    touch[i] += w * upper[j]
                    weight[i] += w
        share = np.where(inside_weight > 0.0, weight / (weight + 0.05), 1.0)
        other = share * touch / np.maximum(weight, 1e-30)
        other += (1.0 - share) * inside / np.maximum(inside_weight, 1e-30)
        further = np.maximum(other, 0.0) > np.maximum(own, 0.0)
        a += np.where(region, np.where(further, 1.0, -1.0) * 0.5 ** (k + 2), 0.0)
    return a


def test_the_literal_search_takes_the_printed_steps(rng, stages, find_contacts, records, jittered):
    scene = Scene()
    for z, young in ((0.0, 1e5), (0.95, 2.7e5)):
        scene.add_body(jittered(1.0, 4), NeoHookean(young, 0.3, 1000.0), (0.0, 0.0, z))
    response = ContactSurface("literal", iterations=4)
    model, state, work, c = searched(scene, stages, find_contacts, records, response)
    x0, s = work.x.numpy().astype(float), work.surface.s.numpy().astype(float)
    region = np.linalg.norm(s, axis=1) > 0.0
    ours = work.surface.fraction.numpy()[region]
    printed = literal_fractions(model, c, x0, s, 4)[region]
    assert region.sum() > 20 and len(np.unique(ours)) > 2
    # A sign may differ where both pressures agree to rounding, and neighbours of that vertex then.
    assert (np.abs(ours - printed) < 1e-6).mean() > 0.95
    moved = x0[region] + ours[:, None] * s[region]
    np.testing.assert_allclose(state.x.numpy()[region], moved, atol=1e-6)  # rounding


@pytest.mark.parametrize("cells", [(4, 4), (4, 6), (3, 7)])
def test_a_uniform_pressure_is_the_same_on_both_sides_whatever_the_density(
    stages, find_contacts, records, cells
):
    strain, young = 0.02, 1e5
    scene = blocks(1.0, cells, overlap=0.0)
    model, state, work = stages(scene)
    x = state.x.numpy()
    x[:, 2] *= 1.0 - strain
    upper = model.vert_body.numpy() == 1
    x[upper, 2] -= OVERLAP
    state.x.assign(x)
    find_contacts(model, work, state.x)
    residual.find_gaps(model, state.x, work)
    search.balance(model, state.x, work, iterations=2)
    c = records(work)
    traction = work.surface.at_start.numpy()
    for side in inner(model, work):
        assert len(side) >= 4
        # Nonlinear to the order of the strain, against E strain.
        np.testing.assert_allclose(traction[side], young * strain, rtol=2.0 * strain)
        # float32 positions against strains of 0.02 over a cell of EDGE / 7.
        np.testing.assert_allclose(traction[side], traction[side].mean(), rtol=1e-3)
    up, lo = work.surface.upper_mean.numpy()[: c.n, 0], work.surface.lower_mean.numpy()[: c.n, 0]
    rim = np.abs(x[c.vert, :2]).max(axis=(1, 2)) > 0.4 * EDGE
    used = (c.residual > 0.0) & ~rim
    assert used.any()
    np.testing.assert_allclose(up[used], lo[used], rtol=1e-3)


def test_bodies_that_are_led_apart_keep_their_angular_momentum(rng):
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    material = NeoHookean(1e5, 0.3, 1000.0)
    way = rng.standard_normal(3)
    scene.add_body(box(0.1, 2), material)
    turn = rng.standard_normal(4)
    scene.add_body(box((0.1, 0.06, 0.05), 2), material, 0.06 * way / np.linalg.norm(way), turn)
    sim = Simulation(scene, fps=120)
    assert sim.measure().overlap > 0.01
    for _ in sim.frames(12):
        now = sim.measure()
        x, v = sim.positions().astype(float), sim.velocities().astype(float)
        scale = sim.model.mass.numpy() @ (np.linalg.norm(x, axis=1) * np.linalg.norm(v, axis=1))
        # Rounding of some hundred steps; without what gives it back it is 1e-3.
        assert np.linalg.norm(now.angular_momentum) < 1e-5 * scale
    assert now.overlap < 1e-4 and now.kinetic > 1e-3
