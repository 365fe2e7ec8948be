"""other_responses.py, predicted forces of many contacts: one pass, momentum, shared vertices."""

import numpy as np
import pytest
import warp as wp

from warp_contact import ContactSurface, NeoHookean, PredictedForce, Scene, Simulation, box
from warp_contact.step import loop, other_responses

DT = 1e-3
FRICTION = 0.4


def meeting(jittered) -> Scene:
    """Two blocks that overlap at the end of the next step, by a part of a cell."""
    scene = Scene(gravity=(0.0, 0.0, 0.0), friction=FRICTION)
    for k, cells in enumerate((3, 4)):
        place = (0.13 * k, 0.07 * k, 0.98 * k)
        velocity = (0.5 * k, 0.0, -2.0 * k)
        material = NeoHookean(1e5, 0.3, 1000.0 * 10.0**k)
        scene.add_body(jittered(1.0, cells, 0.05), material, place, velocity=velocity)
    return scene


def test_every_contact_gets_its_overlap_over_its_share_of_the_masses(
    stages, find_contacts, records, jittered
):
    model, state, work = stages(meeting(jittered), dt=DT)
    ahead = state.x.numpy() + DT * state.v.numpy()
    v0 = state.v.numpy().astype(float)
    work.x.assign(ahead)
    find_contacts(model, work, state.x, work.x, edges=True)
    other_responses._push_apart(model, state, work)
    c, inv_mass = records(work), model.inv_mass.numpy().astype(float)
    real = np.abs(c.coef).sum(axis=1) > 0.0
    among = [np.unique(vert) for vert in c.vert[real]]
    sharing = np.bincount(np.concatenate(among), minlength=model.n_vert)
    weight = (c.coef.astype(float) ** 2 * (inv_mass * sharing)[c.vert]).sum(axis=1)
    gap = np.einsum("ck,cki,ci->c", c.coef, ahead[c.vert].astype(float), c.normal)
    want = np.where(real, np.maximum(-gap, 0.0) / (DT * np.where(real, weight, 1.0)), 0.0)
    assert (want > 0.0).sum() > 10 and sharing.max() > 3
    # Gaps of some hundredths in coordinates of order 1, float32.
    np.testing.assert_allclose(c.normal_impulse, want, rtol=1e-4, atol=1e-4 * want.max())
    slide = np.einsum("ck,cki->ci", c.coef, v0[c.vert])
    slide -= np.einsum("ci,ci->c", slide, c.normal)[:, None] * c.normal
    size = np.linalg.norm(c.friction_impulse, axis=1)
    assert (size <= FRICTION * (1.0 + 1e-5) * c.normal_impulse).all() and size.max() > 0.0
    assert (np.einsum("ci,ci->c", c.friction_impulse, slide) <= 0.0).all()


def launched(monkeypatch, model, state, work, response) -> list[str]:
    """Kernels of a step, with the files that they are from."""
    keys, launch = [], wp.launch

    def note(kernel, *args, **kwargs):
        keys.append(f"{kernel.module.name.split('.')[-1]}.{kernel.key}")
        launch(kernel, *args, **kwargs)

    with monkeypatch.context() as patch:
        patch.setattr(wp, "launch", note)
        loop.step_of(response, overlapping=True)(model, state, work, 0)
    return keys


def test_one_pass_without_sweeps_search_or_closure(monkeypatch, stages, jittered):
    steps = {}
    for response in (PredictedForce(), ContactSurface()):
        model, state, work = stages(meeting(jittered), dt=DT, unit=1e-9)
        steps[type(response)] = launched(monkeypatch, model, state, work, response)
    ours, default = steps[PredictedForce], steps[ContactSurface]
    more = {"closure", "region", "residual", "search"}
    print(sorted(set(default) - set(ours)))
    assert more <= {key.split(".")[0] for key in default}
    assert not more & {key.split(".")[0] for key in ours}
    assert default.count("impulse.solve_contacts") > 1
    assert ours.count("impulse.solve_contacts") == 0
    assert ours.count("predicted.predicted_impulses") == 1
    assert ours.count("impulse.apply_impulses") == 1


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_collision_keeps_the_momentum_and_parts_the_blocks(friction):
    scene = Scene(gravity=(0.0, 0.0, 0.0), friction=friction)
    for k, cells in enumerate((3, 5)):
        material = NeoHookean(1e5, 0.3, 1000.0 * 10.0**k)
        place, velocity = (0.02 * k, 0.01 * k, 0.105 * k), (0.1 * k, 0.0, 0.5 - k)
        scene.add_body(box(0.1, cells), material, place, velocity=velocity)
    sim = Simulation(scene, PredictedForce(), fps=240)
    begun = sim.measure()
    passed = touched = 0.0
    for _ in sim.frames(36):
        now = sim.measure()
        touched = max(touched, now.n_contacts)
        force = now.forces.get(("body0", "body1"), np.zeros(3))
        passed += np.linalg.norm(force) / sim.fps
        # Rounding of velocities of some hundred steps.
        scale = 0.5 * 11.0
        assert np.abs(now.momentum - begun.momentum).max() < 1e-6 * scale
        assert np.abs(now.angular_momentum - begun.angular_momentum).max() < 1e-6 * scale * 0.1
    light, heavy = sim.velocities(0)[:, 2].mean(), sim.velocities(1)[:, 2].mean()
    print(f"{passed} N s, velocities {light}, {heavy}")
    assert touched > 0 and passed > 0.5 and sim.measure().n_contacts == 0
    assert light < heavy
