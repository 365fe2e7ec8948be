"""Restitution in a run: set between frames, checkpoints, worlds, and what is refused."""

import numpy as np
import pytest

import warp_contact as wc
from warp_contact.data import launch

BALL, BOX, SOLID = wc.sphere(0.05, 147), wc.box(0.1, 2), wc.Rigid(1000.0)


def dropped(mesh, restitution, material=SOLID, **settings) -> wc.Simulation:
    """A body that falls 0.1 m onto a plane."""
    scene = wc.Scene(friction=0.3, restitution=restitution)
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(mesh, material, (0.0, 0.0, 0.1 - mesh.vertices[:, 2].min()))
    return wc.Simulation(scene, **settings)


def tops(sim: wc.Simulation, frames: int) -> np.ndarray:
    """Height [m] to which the ball would fly, after each frame."""
    rest, found = -BALL.vertices[:, 2].min(), []
    for _ in sim.frames(frames):
        v = sim.velocities(0)[:, 2].mean()
        found.append(sim.pose(0)[0][2] - rest + v * v / (2.0 * 9.81))
    return np.array(found)


def tossed(seed: int) -> wc.Simulation:
    """Boxes and a ball that fall on each other."""
    rng, scene = np.random.default_rng(seed), wc.Scene(friction=0.4)
    scene.add_plane((0.0, 0.0, 1.0), restitution=0.5)
    for k in range(4):
        at = [*rng.uniform(-0.03, 0.03, 2), 0.09 + 0.13 * k]
        moves = {"angular_velocity": rng.normal(size=3), "restitution": rng.uniform()}
        scene.add_body(BALL if k == 1 else BOX, SOLID, at, rng.normal(size=4), **moves)
    return wc.Simulation(scene)


def test_a_run_goes_on_from_a_checkpoint_between_impacts_with_the_same_bits(rng, tmp_path):
    seed = rng.integers(2**32)
    one, other = tossed(seed), tossed(seed)
    for sim in one, other:
        sim.set_restitution("plane0", 0.9)
    for _ in one.frames(12):
        pass
    one.save(tmp_path / "one.npz")
    other.load(tmp_path / "one.npz")
    for sim in one, other:
        for _ in sim.frames(12):
            pass
    np.testing.assert_array_equal(one.positions(), other.positions())
    np.testing.assert_array_equal(one.velocities(), other.velocities())


def test_it_may_be_set_between_frames_and_is_kept_by_a_checkpoint(tmp_path):
    sim, again = (dropped(BALL, 0.0) for _ in range(2))
    first = tops(sim, 30)
    assert sim._stepper.work.rebound is None  # nothing is allocated, nothing launched
    assert first[-1] < 1e-4
    sim.reset()
    sim.set_restitution(0, 1.0)
    sim.set_restitution("plane0", 0.0)
    sim.save(tmp_path / "set.npz")
    again.load(tmp_path / "set.npz")
    for one in sim, again:
        assert tops(one, 14)[-1] == pytest.approx(0.025, rel=5e-3)
    sim.reset()
    np.testing.assert_array_equal(tops(sim, 30), first)


def test_it_comes_back_with_the_scene_also_where_buffers_grew_without_it():
    sim = dropped(BALL, 0.8)
    first = tops(sim, 30)
    for of in 0, "plane0":
        sim.set_restitution(of, 0.0)
    sim._stepper.buffers.replace(sim._stepper.work.capacity)
    sim.reset()
    np.testing.assert_array_equal(tops(sim, 30), first)


def test_worlds_do_not_feel_what_strikes_in_others():
    def run(worlds):
        scene = wc.Scene(friction=0.4, restitution=0.6)
        scene.add_plane((0.0, 0.0, 1.0))
        turn = np.array([0.2, 0.1, 0.05, 1.0])
        for world in worlds:
            at = 0.0, 0.0, 0.1 + 0.02 * world
            scene.add_body(BOX, SOLID, at, turn, label=f"low{world}", world=world)
            scene.add_body(BOX, SOLID, (0.03, 0, 0.3), turn, label=f"high{world}", world=world)
        return wc.Simulation(scene, substeps=8)

    together, alone = run((0, 1, 2)), run((1,))
    for _ in together.frames(30):
        alone.step_frame()
        for name in "low1", "high1":
            np.testing.assert_array_equal(together.velocities(name), alone.velocities(name))
            np.testing.assert_array_equal(together.force_on(name), alone.force_on(name))
    np.testing.assert_array_equal(together.positions("high1"), alone.positions("high1"))


def test_threads_may_take_contacts_in_any_order(monkeypatch):
    def run():
        sim = tossed(0)
        for _ in sim.frames(20):
            pass
        return sim.velocities()

    expected = run()
    for threads in (5, 10**9):
        monkeypatch.setattr(launch, "ON_CPU", threads)
        np.testing.assert_array_equal(run(), expected)


def test_no_coefficient_and_zero_are_the_same_to_the_last_bit():
    def run(**given):
        scene = wc.Scene(friction=0.4)
        scene.add_plane((0.0, 0.0, 1.0))
        scene.add_body(BOX, SOLID, (0.0, 0.0, 0.1), (0.2, 0.1, 0.05, 1.0))
        scene.add_body(BALL, SOLID, (0.0, 0.0, 0.3))
        scene.add_body(BALL, SOLID, (1.0, 0.0, 0.3), **given)
        sim = wc.Simulation(scene)
        for _ in sim.frames(10):
            pass
        return np.concatenate([sim.positions(0), sim.positions(1)])

    np.testing.assert_array_equal(run(), run(restitution=0.0))


@pytest.mark.parametrize("wrong", [-0.1, 1.1, np.nan, "0.3", (0.1, 0.2)])
def test_what_is_no_coefficient_is_refused(wrong):
    sim = dropped(BALL, 0.5)
    with pytest.raises(ValueError, match="restitution"):
        sim.set_restitution(0, wrong)
    scene = wc.Scene()
    with pytest.raises(ValueError, match=r"body 'ball': .*restitution"):
        scene.add_body(BALL, SOLID, label="ball", restitution=wrong)
    with pytest.raises(ValueError, match="restitution"):
        scene.add_plane((0.0, 0.0, 1.0), restitution=wrong)
    with pytest.raises(ValueError, match="restitution"):
        wc.Scene(restitution=wrong)


def test_steps_that_take_none_say_so_before_the_first():
    soft = wc.NeoHookean(1e5, 0.3, 1000.0)
    with pytest.raises(ValueError, match="restitution needs implicit steps: take integrator"):
        dropped(BOX, 0.5, soft)
    with pytest.raises(ValueError, match=r"restitution needs wc.ContactSurface\(\)"):
        dropped(BOX, 0.5, soft, response=wc.Penalty(1e4), integrator="implicit")
    assert "restitution needs them" in dropped(BOX, 0.5, soft, integrator="auto").summary()
    sim = dropped(BOX, 0.0, soft)
    with pytest.raises(ValueError, match="restitution needs implicit steps: take integrator"):
        sim.set_restitution(0, 0.5)
    assert not sim.model.restitution.numpy().any()
