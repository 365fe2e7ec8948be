"""The matrix of ties against products with the mobility, and row sums of contacts against it."""

import numpy as np
import pytest
import warp as wp

import warp_contact as wc
from warp_contact.frame import implicit_shapes
from warp_contact.step import implicit, ties

SOFT = wc.NeoHookean(2e5, 0.3, 1000.0, 2e-3)
MESH = wc.box((0.1, 0.06, 0.05), (3, 2, 2))


@pytest.fixture
def hanging(monkeypatch) -> wc.Simulation:
    """A large body, one that is held, a rigid and a free one, each attached to the next."""
    monkeypatch.setattr(implicit_shapes, "LARGEST", 40)
    scene, left = wc.Scene(), MESH.vertices[:, 0] < -0.0499
    held = np.flatnonzero(MESH.vertices[:, 2] > 0.0249)[:4]
    scene.add_body(wc.box((0.1, 0.06, 0.05), (4, 2, 2)), SOFT, label="large")
    scene.add_body(MESH, SOFT, (0.1, 0.0, 0.0), fixed=held, label="held")
    scene.add_body(MESH, wc.Rigid(800.0), (0.2, 0.0, 0.0), label="rigid")
    scene.add_body(MESH, SOFT, (0.3, 0.0, 0.0), label="free")
    scene.attach("held", "large", vertices=left)
    scene.attach("rigid", "held", "ball", at=(0.15, 0.01, 0.005))
    scene.attach("free", "rigid", vertices=left, stiffness=1e4)
    scene.attach("rigid", kind="slider", at=(0.2, 0.0, 0.0), axis=(1.0, 2.0, 0.5))
    return wc.Simulation(scene)


def begun(sim: wc.Simulation, h: float = 1 / 240):
    """Its work at the beginning of a step."""
    stepper = sim._stepper
    stepper.buffers.set_steps(np.array([h]))
    stepper.work.dt.fill_(h)
    implicit.find_mobility(sim.model, sim.state.x, stepper.work.implicit)
    ties.begin(sim.state.x, stepper.work)
    return stepper.work


def test_the_factors_are_those_of_products_with_the_mobility(hanging):
    model, work = hanging.model, begun(hanging)
    t, w = work.ties.ties, work.implicit
    n, weight, vert = work.ties.n, t.now.numpy().astype(float), t.vert.numpy()
    line = t.line.numpy().astype(float)
    across = np.eye(3) - line[:, :, None] * line[:, None, :]
    inv_mass = model.inv_mass.numpy().astype(float)
    lumped = np.arange(model.n_vert) < hanging._bodies.range("large").stop
    k = np.zeros((3 * n, 3 * n))
    answer = wp.zeros(model.n_vert, dtype=wp.vec3)
    for column in range(3 * n):
        s, p = column // 3, np.zeros((model.n_vert, 3))
        np.add.at(p, vert[s], weight[s][:, None] * across[s][column % 3])
        implicit.answer(model, wp.array(p, dtype=wp.vec3), answer, w)
        v = np.where(lumped[:, None], inv_mass[:, None] * p, answer.numpy())
        opens = np.einsum("tk,tki->ti", weight, v[vert])
        k[:, column] = np.einsum("tij,tj->ti", across, opens).ravel()
    for s in range(n):
        own = slice(3 * s, 3 * s + 3)
        k[own, own] += t.soft.numpy()[s] * np.eye(3)
        k[own, own] += np.trace(k[own, own]) * np.outer(line[s], line[s])
    blocks = t.matrix.numpy().reshape(n, n, 3, 3)
    lower = np.zeros_like(k)
    for i in range(n):
        for j in range(i + 1):
            block = np.linalg.inv(blocks[i, i]) if i == j else blocks[i, j]
            lower[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] = block
    # Products round to float32, and a millionth is added to the diagonal.
    np.testing.assert_allclose(lower @ lower.T, k, atol=5e-6 * np.abs(k).max())


def test_row_sums_bound_what_contacts_see(hanging, monkeypatch):
    """The matrix of contacts at single vertices, divided by its row sums, has no value above 1."""
    monkeypatch.setattr(implicit_shapes, "LARGEST", 800)
    hanging = wc.Simulation(hanging.scene)
    model, work = hanging.model, begun(hanging)
    t, w, rows = work.ties.ties, work.implicit, work.ties.rows
    chosen = np.concatenate(
        [np.arange(model.n_vert)[hanging._bodies.range(b)][::3] for b in range(4)]
    )
    chosen = chosen[model.inv_mass.numpy()[chosen] > 0.0]
    number = np.bincount(model.vert_body.numpy()[chosen], minlength=4)
    places, start = np.zeros(model.n_vert, dtype=int), model.body_vert.numpy()
    for b in range(4):
        own = chosen[model.vert_body.numpy()[chosen] == b]
        places[start[b] : start[b] + len(own)] = own
    w.touched.n.assign(number)
    w.touched.vert.assign(places)
    w.share.of_vert.fill_(1.0)
    ties.find_rows(work)
    bound = work.mobility.row.numpy()[chosen]
    free, answer = np.zeros((3 * len(chosen),) * 2), wp.zeros(model.n_vert, dtype=wp.vec3)
    for column in range(3 * len(chosen)):
        p = np.zeros((model.n_vert, 3))
        p[chosen[column // 3], column % 3] = 1.0
        implicit.answer(model, wp.array(p, dtype=wp.vec3), answer, w)
        work.implicit.before.zero_()
        v = wp.clone(answer)
        work.ties.ties.moved.fill_(1)
        ties.settle(model, v, work, keeps=False)
        free[:, column] = v.numpy()[chosen].ravel()
    scale = 1.0 / np.sqrt(np.repeat(bound, 3))
    largest = np.linalg.eigvalsh(0.5 * (free + free.T) * np.outer(scale, scale)).max()
    assert 0.1 < largest < 1.0
    assert rows.n.numpy()[0] == len(chosen) and t.state.numpy().all()
