"""What a user sets between the frames of implicit steps, and hard contacts of rigid bodies."""

import numpy as np
import pytest
import warp as wp

import warp_contact as wc
from warp_contact.frame import implicit_shapes

RIGID = wc.Rigid(1000.0)


def on_the_floor(*densities: float, **settings):
    scene = wc.Scene(friction=0.5)
    scene.add_plane((0.0, 0.0, 1.0))
    for k, density in enumerate(densities):
        scene.add_body(wc.box(0.1, 2), wc.Rigid(density), (0.0, 0.0, 0.05 + 0.1 * k))
    return wc.Simulation(scene, **settings)


def floor_force(sim) -> float:
    """Over the weight."""
    weight = 9.81 * float(sim.model.mass.numpy().sum())
    return sim.measure().forces["body0", "plane0"] / weight


@pytest.mark.parametrize("densities", [(100.0, 2e3), (100.0, 1e4), (1e3,) * 6])
def test_a_stack_of_rigid_bodies_rests_also_under_a_heavy_one(densities):
    sim, found = on_the_floor(*densities), []
    for _ in sim.frames(60):
        found.append(floor_force(sim))
    # It may still swing a little; twenty sweeps in place of a hundred leave 0.65 to 1.4.
    assert np.mean(found[40:]) == pytest.approx(1.0, abs=0.02)
    assert np.abs(np.subtract(found[40:], 1.0)).max() < 0.1
    assert sim.measure().overlap < 2e-3 * sim.model.body_edge.numpy().min()


def test_a_force_that_would_push_a_body_through_a_plate_gets_more_steps():
    scene = wc.Scene(friction=0.5)
    scene.add_body(wc.box((0.2, 0.2, 0.005), (4, 4, 1)), RIGID, (0.0, 0.0, -0.0025), fixed=True)
    tool = scene.add_body(wc.box(0.02, 2), RIGID, (0.01, 0.005, 0.0101))
    sim = wc.Simulation(scene)
    for _ in sim.frames(10):
        pass
    for _ in range(5):
        sim.apply(tool, force=(0.0, 0.0, -3.0))
        sim.step_frame()
    assert sim.pose(tool)[0][2] == pytest.approx(0.01, abs=1e-4)
    assert sim.measure().tunnelled == 0


def test_a_force_wakes_a_body():
    sim = on_the_floor(1000.0, sleeping=True)
    for _ in sim.frames(90):
        pass
    assert sim._stepper.work.awake.bodies.numpy()[0] == 0
    for _ in range(12):
        sim.apply(0, force=(0.0, 0.0, 30.0))
        sim.step_frame()
    mass = float(sim.model.mass.numpy().sum())
    assert sim.pose(0)[0][2] - 0.05 == pytest.approx(0.5 * (30.0 / mass - 9.81) * 0.04, rel=0.02)


def test_a_body_that_is_set_elsewhere_keeps_its_motion():
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(wc.box((0.1, 0.2, 0.3), 2), RIGID, angular_velocity=(3.0, 0.0, 0.0))
    scene.add_body(wc.box(0.1, 2), wc.NeoHookean(1e5, 0.3, 1000.0), (1.0, 0.0, 0.0))
    sim = wc.Simulation(scene)
    for _ in sim.frames(2):
        pass
    sim.set_pose(0, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0, 1.0))
    x, v = sim.positions(0).astype(float), sim.velocities(0)
    spin = np.cross([3.0, 0.0, 0.0], x - x.mean(axis=0))
    np.testing.assert_allclose(v, spin, atol=1e-5)
    # Of a soft body every velocity stays: half a step damps none of it twice.
    stretch = 10.0 * (sim.positions(1) - [1.0, 0.0, 0.0]) * [1.0, 0.0, 0.0]
    sim.set_velocity(1, stretch)
    for _ in range(3):
        np.testing.assert_allclose(sim.velocities(1), stretch, atol=1e-5)
        sim.set_positions(1, sim.positions(1) + [1e-3, 0.0, 0.0])


def pushed():
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(wc.box(0.1, 2), RIGID)
    return wc.Simulation(scene)


def test_what_is_to_act_is_in_a_checkpoint_and_not_after_a_reset(tmp_path):
    sim, again = pushed(), pushed()
    sim.apply(0, force=(1.0, 0.0, 0.0))
    sim.save(tmp_path / "before.npz")
    again.load(tmp_path / "before.npz")
    for each in (sim, again):
        each.step_frame()
    assert sim.velocities()[0, 0] > 1e-3
    np.testing.assert_array_equal(again.velocities(), sim.velocities())
    sim.apply(0, force=(1.0, 0.0, 0.0))
    sim.reset(worlds=[0])
    sim.step_frame()
    assert np.abs(sim.velocities()).max() < 1e-6


def test_a_frame_that_fails_leaves_what_was_to_act(monkeypatch):
    sim = pushed()
    sim.step_frame()
    sim.apply(0, force=(1000.0, 0.0, 0.0))
    stepper = sim._stepper
    with monkeypatch.context() as m:
        m.setattr(stepper.wrench, "finish", lambda: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            sim.step_frame()
    assert np.abs(sim.velocities()).max() == 0.0
    sim.step_frame()
    assert sim.velocities()[0, 0] == pytest.approx(1000.0 / 60 / 1.0, rel=1e-3)


def test_an_interrupt_while_inverses_are_found_leaves_none_half_done(monkeypatch):
    def dropped():
        scene = wc.Scene()
        scene.add_plane((0.0, 0.0, 1.0))
        scene.add_body(wc.box(0.1, 2), wc.NeoHookean(1e5, 0.3, 1000.0), (0.0, 0.0, 0.0501))
        return wc.Simulation(scene, integrator="implicit")

    def interrupt(*_):
        raise KeyboardInterrupt

    sim, whole = dropped(), dropped()
    with monkeypatch.context() as m:
        m.setattr(implicit_shapes, "_inverse", interrupt)
        with pytest.raises(KeyboardInterrupt):
            sim.step_frame()
    for each in (sim, whole):
        for _ in each.frames(5):
            pass
    np.testing.assert_array_equal(sim.positions(), whole.positions())


def test_a_rigid_body_is_not_given_another_shape():
    sim = pushed()
    x = sim.positions()
    for wrong in (x * [1.5, 1.0, 1.0], x * [-1.0, 1.0, 1.0], 0.0 * x):
        with pytest.raises(ValueError, match="'body0' is rigid"):
            sim.set_positions(0, wrong)
    sim.set_positions(0, x[:, [1, 2, 0]] + 1.0)  # a turn
    with pytest.raises(ValueError, match="angular_velocity"):
        wc.Scene().add_body(wc.box(0.1, 2), RIGID, fixed=True, angular_velocity=(0, 0, 1))
    scene = wc.Scene()
    scene.add_body(wc.box(0.1, 2), RIGID, fixed=True)
    with pytest.raises(ValueError, match="it is fixed"):
        wc.Simulation(scene).apply(0, force=(1.0, 0.0, 0.0))


def test_a_fixed_rigid_body_needs_no_implicit_steps():
    scene = wc.Scene()
    scene.add_body(wc.box(0.1, 2), RIGID, fixed=True)
    scene.add_body(wc.box(0.05, 2), wc.NeoHookean(1e5, 0.3, 1000.0), (0.0, 0.0, 0.0751))
    sim = wc.Simulation(scene)
    assert "explicit" in sim.summary()
    for _ in sim.frames(10):
        pass
    assert sim.measure().overlap < 1e-5


def test_rigid_bodies_alone_launch_nothing_for_bodies_that_deform(monkeypatch):
    """Elastic forces, conjugate gradients, answers of strained bodies."""
    launched, launch = set(), wp.launch

    def note(kernel, *args, **given):
        launched.add(kernel.module.name.split("kernels.")[-1])
        return launch(kernel, *args, **given)

    monkeypatch.setattr(wp, "launch", note)
    needless = {"elastic.neo_hookean", "implicit.solve", "implicit.predict", "implicit.settle"}
    for material, some in (
        (wc.Rigid(1e3), {"implicit.predict"}),
        (wc.NeoHookean(1e5, 0.3, 1e3), needless),
    ):
        launched.clear()
        scene = wc.Scene()
        scene.add_plane((0.0, 0.0, 1.0))
        scene.add_body(wc.box(0.1, 2), material, (0.0, 0.0, 0.0501))
        wc.Simulation(scene, integrator="implicit").step_frame()
        assert "impulse.coupled" in launched
        assert needless & launched == some
