"""How a body answers impulses as a whole: kernels against dense matrices in NumPy."""

from itertools import pairwise

import numpy as np
import pytest
import warp as wp

import warp_contact as wc
from warp_contact.frame.implicit_shapes import Inverses, find_shapes
from warp_contact.step import coupled, forces
from warp_contact.step.implicit import answer, find_mobility

H = 4e-3  # [s]


def simulation(fixed=None, copies: int = 1, modulus: float = 1e5, cells=(3, 2, 2), **settings):
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    for k in range(copies):
        turned = (0.0, 0.0, np.sin(0.3 * k), np.cos(0.3 * k))
        material = wc.NeoHookean(modulus, 0.3, 1000.0, 1e-3)
        place = (0.3 * k, 0.0, 0.0)
        scene.add_body(wc.box((0.1, 0.06, 0.05), cells), material, place, turned, fixed=fixed)
    return wc.Simulation(scene, integrator="implicit", **settings)


def ready(sim, x: np.ndarray):
    """The work of implicit steps H at positions ``x`` (n_vert, 3)."""
    sim._stepper.buffers.set_steps(np.full(sim._stepper.worlds.n, H))
    work = sim._stepper.work.implicit
    sim.state.x.assign(x)
    find_mobility(sim.model, sim.state.x, work)
    return work


def mobility(sim, work) -> np.ndarray:
    """G as a matrix, column by column."""
    n = sim.model.n_vert
    out = wp.zeros(n, dtype=wp.vec3)
    columns = []
    for unit in np.eye(3 * n, dtype=np.float32).reshape(-1, n, 3):
        answer(sim.model, wp.array(unit, dtype=wp.vec3), out, work)
        columns.append(out.numpy().ravel().astype(float))
    return np.stack(columns, axis=1)


def bent(x: np.ndarray, rng) -> np.ndarray:
    """Bent by about a radian, sheared, turned and moved."""
    angle = 8.0 * x[:, 0]
    y = np.stack(
        [np.sin(angle) / 8.0 - x[:, 2] * np.sin(angle), x[:, 1], x[:, 2] * np.cos(angle)], 1
    )
    y[:, 1] += 0.2 * y[:, 0]
    q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    return y @ (q * np.linalg.det(q)).T + 0.1


def rigid_modes(x: np.ndarray) -> np.ndarray:
    n = len(x)
    modes = np.zeros((n, 3, 6))
    modes[:, :, :3] = np.eye(3)
    for k in range(3):
        modes[:, :, 3 + k] = np.cross(np.eye(3)[k], x - x.mean(axis=0))
    return modes.reshape(3 * n, 6)


@pytest.mark.parametrize("modulus", [1e5, 1e11])
def test_the_mobility_keeps_momentum_and_is_symmetric_wherever_the_body_is(rng, modulus):
    sim = simulation(modulus=modulus)
    x = bent(sim.positions(), rng)
    g = mobility(sim, ready(sim, x))
    m = np.repeat(sim.model.mass.numpy().astype(float), 3)
    modes = rigid_modes(x)
    size = np.abs(g).max()
    # Float32 positions and velocities: some 1e-7 of the parts that are added.
    assert np.abs(modes.T @ (m[:, None] * g) - modes.T).max() < 2e-6
    assert np.abs(g - g.T).max() < 2e-6 * size
    assert np.linalg.eigvalsh(0.5 * (g + g.T)).min() > -1e-5 * size


@pytest.mark.parametrize("cells", [(3, 2, 2), (2, 2, 2), (4, 1, 1), (2, 2, 4)])
def test_at_rest_it_is_the_inverse_of_the_matrix_of_a_step(dense, cells):
    """Of 36, 27, 20 and 45 vertices: four are multiplied at once, the last ones may be fewer."""
    sim = simulation(cells=cells)
    rest = sim.positions()
    g = mobility(sim, ready(sim, rest))
    m = np.repeat(sim.model.mass.numpy().astype(float), 3)
    k = dense(forces.apply_stiffness, sim.model, rest)
    c = dense(forces.apply_damping, sim.model, rest)
    expected = np.linalg.inv(np.diag(m) + H * c + H * H * k)
    assert np.abs(g - expected).max() < 1e-5 * np.abs(expected).max()  # float32 sums of 135 terms


def at_contacts(sim, work, p: np.ndarray) -> np.ndarray:
    """How impulses ``p`` (n_vert, 3) of contacts, where they are not 0, move all vertices."""
    for b, (first, last) in enumerate(pairwise(sim.model.body_vert.numpy())):
        own = first + np.flatnonzero(np.abs(p[first:last]).any(axis=1))
        verts, n = work.touched.vert.numpy(), work.touched.n.numpy()
        verts[first : first + len(own)], n[b] = own, len(own)
        work.touched.vert.assign(verts)
        work.touched.n.assign(n)
    out = wp.zeros(sim.model.n_vert, dtype=wp.vec3)
    coupled.answer(sim.model, wp.array(p, dtype=wp.vec3), out, work)
    return out.numpy().astype(float)


@pytest.mark.parametrize("cells", [(3, 2, 2), (2, 2, 2)])
def test_impulses_of_contacts_move_a_body_by_its_mobility(rng, cells):
    sim = simulation(copies=2, cells=cells)
    work = ready(sim, sim.positions())
    p = np.zeros((sim.model.n_vert, 3), dtype=np.float32)
    few = rng.choice(len(p) // 2, 7, replace=False)  # of the first body, none of the second
    p[few] = rng.standard_normal((7, 3))
    out = wp.zeros(len(p), dtype=wp.vec3)
    answer(sim.model, wp.array(p, dtype=wp.vec3), out, work)
    moved = at_contacts(sim, work, p)
    # Float32: the first sums of the mobility are over all vertices.
    np.testing.assert_allclose(moved, out.numpy(), atol=2e-5 * np.abs(moved).max())
    assert np.abs(moved[len(p) // 2 :]).max() == 0.0


def test_they_keep_momentum_where_it_is_bent(rng):
    sim = simulation(modulus=1e5)
    x = bent(sim.positions(), rng)
    work = ready(sim, x)
    p = np.zeros((len(x), 3), dtype=np.float32)
    p[rng.choice(len(p), 5, replace=False)] = rng.standard_normal((5, 3))
    m, modes = np.repeat(sim.model.mass.numpy().astype(float), 3), rigid_modes(x)
    got = modes.T @ (m * at_contacts(sim, work, p).ravel())
    # Float32 velocities: some 1e-7 of the parts that are added.
    np.testing.assert_allclose(got, modes.T @ p.ravel(), atol=3e-6 * np.abs(p).sum())


def test_a_body_that_is_turned_answers_turned_impulses_turned(rng):
    sim = simulation()
    rest = sim.positions().astype(float)
    q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    q *= np.linalg.det(q)
    g0 = mobility(sim, ready(sim, rest))
    g = mobility(sim, ready(sim, rest @ q.T + 1.0))
    turn = np.kron(np.eye(len(rest)), q)
    # Float32 positions a metre from the origin: rounding of 1e-7 in edges of 0.03.
    assert np.abs(g - turn @ g0 @ turn.T).max() < 1e-4 * np.abs(g0).max()


def test_fixed_vertices_do_not_answer():
    chosen = np.zeros(36, dtype=bool)
    chosen[:9] = True
    sim = simulation(fixed=chosen)
    g = mobility(sim, ready(sim, sim.positions()))
    held = np.repeat(chosen, 3)
    assert np.abs(g[held]).max() == 0.0 and np.abs(g[:, held]).max() == 0.0
    assert np.linalg.eigvalsh(0.5 * (g + g.T)[~held][:, ~held]).min() > 0.0


def test_equal_bodies_share_one_inverse_wherever_they_stand():
    sim = simulation(copies=3)
    x = sim.positions().astype(float)
    shapes = find_shapes(sim.model, x)
    assert set(shapes.of_body) == {0} and len(shapes.first) == 2
    blocks, norms = Inverses(sim.model, shapes).blocks(H)
    assert blocks.shape == (9 * 36, 3, 12) and norms.shape == (9 * 36, 4)  # rows, four at once
    turned = shapes.placed[1]
    np.testing.assert_allclose(turned[:2, 0], [np.cos(0.6), np.sin(0.6)], atol=1e-5)


def test_bodies_that_differ_do_not_share():
    scene = wc.Scene()
    box = wc.box(0.1, 2)
    for k, modulus in enumerate((1e5, 1e5, 2e5)):
        scene.add_body(box, wc.NeoHookean(modulus, 0.3, 1000.0), (0.3 * k, 0.0, 0.0))
    scene.add_body(wc.box((0.1, 0.1, 0.2), 2), wc.NeoHookean(1e5, 0.3, 1000.0), (2.0, 0.0, 0.0))
    sim = wc.Simulation(scene)
    shapes = find_shapes(sim.model, sim.positions().astype(float))
    assert list(shapes.of_body) == [0, 0, 1, 2]


def test_the_inverses_of_the_last_steps_are_kept():
    sim = simulation()
    x = sim.positions().astype(float)
    inverses = Inverses(sim.model, find_shapes(sim.model, x))
    first = inverses.blocks(H)
    assert inverses.blocks(H)[0] is first[0]
    for k in range(2, 11):
        inverses.blocks(H / k)
    assert inverses.blocks(H)[0] is not first[0]
    np.testing.assert_array_equal(inverses.blocks(H)[0], first[0])
