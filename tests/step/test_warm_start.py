"""warm_start.py, vertices: the impulses of a step are those that the next one starts from."""

import numpy as np
import pytest
import warp as wp

from warp_contact import NeoHookean, Scene, TetMesh
from warp_contact.step import impulse, warm_start

DT = 1e-3
RUBBER = NeoHookean(1e5, 0.3, 1000.0)
TOP = np.array([[-3.0, -2.0, 0.0], [3.0, -2.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, -5.0]])
TIP = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 1.0], [-0.2, 0.3, 1.0], [-0.2, -0.3, 1.0]])
TWO = 8.0  # m from one triangle to the other


@pytest.fixture
def pressed(rng, stages, find_contacts):
    """A tip that slides on the first of two triangles, after the impulses of a step."""
    scene = Scene(gravity=(0.0, 0.0, 0.0), friction=0.4)
    for k in range(2):
        scene.add_body(TetMesh(TOP, [[0, 2, 1, 3]]), RUBBER, (TWO * k, 0.0, 0.0))
    v = (*rng.uniform(-3.0, 3.0, 2), -3.0)
    tip = TetMesh(TIP, [[0, 1, 2, 3]])
    scene.add_body(tip, RUBBER, (*rng.uniform(-0.5, 0.5, 2), 0.0), velocity=v)
    model, state, work = stages(scene, dt=DT)
    ahead = wp.array(state.x.numpy() + DT * state.v.numpy(), dtype=wp.vec3)
    assert find_contacts(model, work, state.x, ahead).n == 1
    impulse.exchange(model, state.v, work)
    impulse.finish(state.x, work)
    return model, state, work


def recalled(model, x, work, find_contacts, records):
    """The contact at the positions x, with the impulses from which a step would start there."""
    x = wp.array(x, dtype=wp.vec3)
    work.broad_phase.stale.fill_(1)
    assert find_contacts(model, work, x).n == 1
    warm_start.recall_vertices(work)
    return records(work)


def test_the_impulses_of_a_step_are_kept_for_the_next(pressed, find_contacts, records):
    model, state, work = pressed
    before = records(work)
    after = recalled(model, state.x.numpy(), work, find_contacts, records)
    assert before.normal_impulse[0] > 0.0 and np.linalg.norm(before.friction_impulse[0]) > 0.0
    np.testing.assert_allclose(after.normal_impulse, before.normal_impulse, rtol=1e-6)
    size = before.normal_impulse[0]
    np.testing.assert_allclose(after.friction_impulse, before.friction_impulse, atol=1e-6 * size)


def test_a_kept_friction_impulse_turns_with_the_normal(rng, pressed, find_contacts, records):
    """Nothing of it pushes or pulls along the normal that there is now."""
    model, state, work = pressed
    before = records(work)
    angle, axis = rng.uniform(0.2, 0.5), rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    k = np.cross(np.eye(3), axis)
    rotate = np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k
    x = state.x.numpy()
    x[8:, 2] -= 0.02  # well inside: rounding does not decide which side is near
    after = recalled(model, x @ rotate.T, work, find_contacts, records)
    n, kept, size = after.normal[0], before.friction_impulse[0], before.normal_impulse[0]
    np.testing.assert_allclose(n, rotate[:, 2], atol=1e-5)  # float32
    level = kept - (kept @ n) * n
    assert np.linalg.norm(kept - level) > 1e-3 * np.linalg.norm(kept)
    np.testing.assert_allclose(after.normal_impulse[0], size, rtol=1e-6)
    np.testing.assert_allclose(after.friction_impulse[0], level, atol=1e-5 * size)
    # What the vertices get is that and nothing else.
    part = work.contacts.part.numpy()[:5].sum(axis=0)
    np.testing.assert_allclose(part, 0.0, atol=1e-5 * size)
    tip = after.normal_impulse[0] * n + level
    np.testing.assert_allclose(work.contacts.part.numpy()[0], tip, atol=1e-5 * size)


def test_an_impulse_is_not_recalled_against_another_body(pressed, find_contacts, records):
    model, state, work = pressed
    assert records(work).pair[0].tolist() == [2, 0]
    x = state.x.numpy()
    x[8:, 0] += np.float32(TWO)
    after = recalled(model, x, work, find_contacts, records)
    assert after.pair[0].tolist() == [2, 1]
    assert after.normal_impulse[0] == 0.0 and not after.friction_impulse.any()
    assert not work.contacts.part.numpy()[:5].any()
