"""Implicit steps: momentum, energy, statics, free flight, repeats; what they refuse."""

import numpy as np
import pytest

import warp_contact as wc
from warp_contact.frame.step_bounds import implicit_steps


def spinning_bar(modulus: float, damping: float):
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    bar = wc.box((0.1, 0.06, 0.03), (4, 3, 2))
    arm = bar.vertices - bar.vertices.mean(axis=0)
    material = wc.NeoHookean(modulus, 0.3, 1000.0, damping)
    scene.add_body(bar, material, velocity=np.cross([6.0, -14.0, 4.0], arm))
    return wc.Simulation(scene, integrator="implicit", substeps=4)


@pytest.mark.parametrize("damping", [0.0, 1e-3])
@pytest.mark.parametrize("modulus", [1e5, 1e8, 1e12])
def test_a_spinning_body_keeps_momentum_and_gains_no_energy(modulus, damping):
    sim = spinning_bar(modulus, damping)
    start = sim.measure()
    for _ in sim.frames(30):
        now = sim.measure()
        # The start is not in equilibrium with its spin: it stretches, and swings about that.
        assert now.energy <= 1.001 * start.energy
        away = now.angular_momentum - start.angular_momentum
        assert np.abs(away).max() <= 2e-6 * np.abs(start.angular_momentum).max()
    assert np.abs(now.momentum).max() <= 1e-6 * 15.0 * sim.model.mass.numpy().sum() * 0.1
    assert now.energy >= 0.97 * start.energy  # the spin is not damped


def colliding(damping: float, substeps: int, modulus: float = 1e5):
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.3)
    material = wc.NeoHookean(modulus, 0.3, 1000.0, damping)
    scene.add_body(wc.box(0.1, 3), material, (0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.5))
    q = np.array([0.1, 0.2, 0.05, 1.0])
    place, turned = (0.03, 0.02, 0.14), q / np.linalg.norm(q)
    scene.add_body(wc.box(0.1, 3), material, place, turned, velocity=(0.0, 0.0, -0.5))
    return wc.Simulation(scene, integrator="implicit", substeps=substeps)


@pytest.mark.parametrize("damping", [0.0, 1e-3])
def test_a_collision_keeps_momentum_and_loses_less_energy_in_shorter_steps(damping):
    kept = []
    for substeps in (4, 16):
        sim = colliding(damping, substeps)
        start = sim.measure()
        deepest = 0.0
        for _ in sim.frames(20):
            now = sim.measure()
            assert now.energy <= 1.001 * start.energy
            deepest = max(deepest, now.overlap)
        scale = 0.5 * sim.model.mass.numpy().sum()  # of the momentum of one block
        assert np.abs(now.momentum - start.momentum).max() <= 1e-6 * scale
        away = now.angular_momentum - start.angular_momentum
        assert np.abs(away).max() <= 1e-4 * 0.1 * scale  # arms are taken at the start of a step
        assert deepest <= 1e-4 * 0.1
        kept.append(now.energy / start.energy)
    assert 0.3 < kept[0] < kept[1]


@pytest.mark.parametrize("moduli", [(5e4, 5e6), (5e4, 5e9), (5e11, 5e11)])
def test_stacked_blocks_come_to_rest_with_their_weight_on_the_floor(moduli):
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    for k, modulus in enumerate(moduli):
        place = (0.01 * k, 0.02 * k, 0.0505 + 0.11 * k)
        scene.add_body(wc.box(0.1, 4), wc.NeoHookean(modulus, 0.3, 1000.0, 1e-3), place)
    sim = wc.Simulation(scene, integrator="implicit")
    for _ in sim.frames(45):
        assert sim.substeps == 4
    begin, pushed = sim.measure(), 0.0
    for _ in sim.frames(15):
        now = sim.measure()
        pushed += sum(f for pair, f in now.forces.items() if "plane0" in pair) / sim.fps
        # The closure leaves 1e-4 of an edge along the contact; blocks that rock reach 1.03e-4.
        assert now.overlap <= 1.2e-4 * sim.model.body_edge.numpy().min()
    weight = 9.81 * sim.model.mass.numpy().sum()
    gained = now.momentum[2] - begin.momentum[2]
    # Half a step's force at both ends belongs to the velocities at that time.
    assert abs(pushed - 15 / 60 * weight - gained) < 2e-3 * weight * 15 / 60
    assert abs(gained) < 1e-2 * weight * 15 / 60
    assert now.kinetic < 1e-3 * weight * 0.1


def test_free_flight_is_exact_at_any_number_of_steps():
    for substeps in (1, 4, 7):
        scene = wc.Scene()
        scene.add_body(wc.box(0.1, 2), wc.NeoHookean(1e7, 0.3, 1000.0), velocity=(1.0, 0.0, 2.0))
        sim = wc.Simulation(scene, integrator="implicit", substeps=substeps, fps=30)
        begin = sim.positions().mean(axis=0)
        for frame in sim.frames(12):
            t = frame / 30.0
            path = np.array([1.0, 0.0, 2.0]) * t - np.array([0.0, 0.0, 4.905]) * t * t
            assert np.abs(sim.positions().mean(axis=0) - begin - path).max() < 1e-5
            speed = np.array([1.0, 0.0, 2.0]) - np.array([0.0, 0.0, 9.81]) * t
            assert np.abs(sim.velocities().mean(axis=0) - speed).max() < 1e-5


def test_short_implicit_steps_lead_where_explicit_ones_do():
    def swing(**settings):
        scene = wc.Scene()
        bar = wc.box((0.2, 0.04, 0.04), (6, 1, 1))
        held = bar.vertices[:, 0] < bar.vertices[:, 0].min() + 1e-6
        scene.add_body(bar, wc.NeoHookean(1e6, 0.3, 1000.0, 1e-3), fixed=held)
        sim = wc.Simulation(scene, **settings)
        return np.array([sim.positions()[:, 2].min() for _ in sim.frames(20)])

    exact = swing()
    sag = exact.max() - exact.min()
    off = [np.abs(swing(integrator="implicit", substeps=n) - exact).max() for n in (4, 64)]
    assert off[1] < 0.02 * sag and off[1] < 0.3 * off[0]


def test_two_runs_have_the_same_bits_and_a_reset_repeats_them():
    a, b = colliding(1e-3, 8), colliding(1e-3, 8)
    for sim in (a, b):
        for _ in sim.frames(12):
            pass
    np.testing.assert_array_equal(a.positions(), b.positions())
    a.reset()
    for _ in a.frames(12):
        pass
    np.testing.assert_array_equal(a.positions(), b.positions())


def test_a_run_that_is_loaded_goes_on_with_the_same_bits(tmp_path):
    whole, half = colliding(1e-3, 8), colliding(1e-3, 8)
    for _ in half.frames(9):
        pass
    half.save(tmp_path / "half.npz")
    again = colliding(1e-3, 8)
    again.load(tmp_path / "half.npz")
    for sim, n in ((whole, 14), (again, 5)):
        for _ in sim.frames(n):
            pass
    np.testing.assert_array_equal(again.positions(), whole.positions())
    np.testing.assert_array_equal(again.velocities(), whole.velocities())


def one_block(**settings):
    scene = wc.Scene()
    scene.add_body(wc.box(0.1, 2), wc.NeoHookean(settings.pop("modulus", 1e5), 0.3, 1000.0))
    return wc.Simulation(scene, **settings)


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"response": wc.ContactSurface(search="literal")}, "the literal search moves vertex by"),
    ],
)
def test_what_takes_no_implicit_steps_is_refused_with_its_reason(settings, reason):
    with pytest.raises(ValueError, match=reason):
        one_block(integrator="implicit", **settings)
    assert "explicit steps" in one_block(integrator="auto", **settings).summary()


def test_a_body_with_too_many_vertices_is_refused_by_name():
    scene = wc.Scene()
    material = wc.NeoHookean(1e5, 0.3, 1000.0)
    scene.add_body(wc.box(0.1, 9), material, label="cheese")
    with pytest.raises(ValueError, match="'cheese' has 1000 vertices"):
        wc.Simulation(scene, integrator="implicit")


def test_an_unknown_integrator_is_refused():
    with pytest.raises(ValueError, match="integrator"):
        one_block(integrator="verlet")


def test_the_steps_of_a_frame_come_from_a_short_list():
    found = {int(implicit_steps(0.0, u, 60.0)) for u in np.geomspace(1.0, 2000.0, 200)}
    assert found == {4, 6, 8, 12, 16, 24, 32, 48, 64, 96}
    assert implicit_steps(np.zeros(2), np.array([0.0, 900.0]), 1000.0).tolist() == [1, 2]


def test_beside_explicit_bodies_steps_shrink_only_where_fewer_suffice_with_room():
    asked = (47.0, 0), (47.0, 64), (40.0, 64), (70.0, 64)  # steps needed, and in the last frame
    taken = [implicit_steps(60.0 * n, 0.0, 60.0, last=last).item() for n, last in asked]
    assert taken == [48, 64, 48, 96]


def test_a_block_that_is_crushed_recovers_and_gains_no_energy():
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    scene.add_body(wc.box(0.1, 3), wc.NeoHookean(1e5, 0.3, 1000.0, 1e-3), (0.0, 0.0, 0.0501))
    heavy, place = wc.NeoHookean(1e7, 0.3, 2e4, 1e-3), (0.01, 0.0, 0.152)
    scene.add_body(wc.box(0.1, 2), heavy, place, velocity=(0.0, 0.0, -3.0))
    sim = wc.Simulation(scene, integrator="implicit")
    start, most, flattest = sim.measure().energy, 0, 1.0
    for _ in sim.frames(10):
        now = sim.measure()
        most, flattest = max(most, sim.substeps), min(flattest, now.volume_ratio)
        assert now.energy <= 1.001 * start
    # It was pressed so hard that long steps would have turned it inside out, and it came back.
    assert most >= 32 and flattest < 0.3
    assert now.inverted == 0 and now.volume_ratio > 0.8 and sim.substeps <= 8


def block_and_ball(scene, world: int) -> None:
    """A block that falls onto another, tilted."""
    material = wc.NeoHookean(1e5, 0.3, 1000.0, 1e-3)
    scene.add_body(wc.box(0.1, 2), material, (0.0, 0.0, 0.051), world=world)
    turned = np.array([0.1, 0.2, 0.05, 1.0]) / np.linalg.norm([0.1, 0.2, 0.05, 1.0])
    place, down = (0.02, 0.01, 0.18), (0.0, 0.0, -1.0)
    scene.add_body(wc.box(0.08, 2), material, place, turned, velocity=down, world=world)


def fast(scene) -> None:
    shot = wc.NeoHookean(1e5, 0.3, 1000.0, 1e-3)
    scene.add_body(wc.box(0.1, 2), shot, (0.0, 0.0, 2.0), velocity=(9.0, 0.0, 0.0), world=7)
    scene.add_body(wc.box(0.1, 2), shot, (0.0, 0.0, 5.0), world=7, fixed=True)  # 24 steps a frame


def stiff(scene) -> None:
    scene.add_body(wc.box(0.1, 3), wc.NeoHookean(1e11, 0.3, 7800.0), (0.0, 0.0, 0.07), world=7)


def rigid(scene) -> None:
    scene.add_body(wc.box(0.1, 2), wc.Rigid(1000.0), (0.0, 0.0, 0.07), world=7)


@pytest.mark.parametrize("neighbour", [fast, stiff, rigid])
def test_a_world_does_not_feel_its_neighbours(neighbour):
    runs = []
    for beside in (False, True):
        scene = wc.Scene(friction=0.3)
        scene.add_plane((0.0, 0.0, 1.0))
        if beside:
            neighbour(scene)
        block_and_ball(scene, 3)
        sim = wc.Simulation(scene, integrator="implicit")
        runs.append([sim.positions()[-54:].copy() for _ in sim.frames(24)])
    np.testing.assert_array_equal(*runs)


def test_small_slow_motion_swings_back_in_short_steps():
    """Each step changes a velocity by less than 1e-6 of an edge in a step."""

    def swing(integrator):
        scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
        block = wc.box(1.5, 2)
        stretch = 0.02 * block.vertices * (1.0, 0.0, -1.0)
        scene.add_body(block, wc.Corotated(400.0, 0.0, 1300.0), velocity=stretch)
        sim = wc.Simulation(scene, fps=30, integrator=integrator, substeps=64)
        return np.array([np.ptp(sim.positions()[:, 0]) for _ in sim.frames(150)]) - 1.5

    exact, found = swing("explicit"), swing("implicit")
    assert exact.min() < -0.3 * exact.max()  # it has swung back
    assert np.abs(found - exact).max() < 0.02 * exact.max()


def bent_beam(bend: float, **settings):
    """A beam that bends itself by some 53 (bend 6) or 125 degrees (15)."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    beam = wc.box((0.6, 0.05, 0.05), (24, 2, 2))
    x, v = beam.vertices[:, 0], np.zeros_like(beam.vertices)
    v[:, 2] = 4.0 * bend * (x**2 - (x**2).mean()) / 0.6
    scene.add_body(beam, wc.NeoHookean(1e6, 0.3, 1000.0, 1e-3), velocity=v)
    return wc.Simulation(scene, **settings)


def test_a_bent_beam_keeps_the_energy_of_what_the_steps_resolve():
    kept = {}
    for settings in ({"integrator": "explicit"}, {"integrator": "implicit", "substeps": 8}):
        sim = bent_beam(6.0, **settings)
        start = sim.measure().energy
        for _ in sim.frames(20):
            pass
        kept[settings["integrator"]] = sim.measure().energy / start
    assert kept["explicit"] == pytest.approx(0.66, abs=0.01)
    assert kept["implicit"] == pytest.approx(kept["explicit"], rel=0.02)


def test_a_beam_that_is_bent_far_gains_no_energy_at_the_steps_that_it_gets():
    sim = bent_beam(15.0, integrator="implicit")
    start = sim.measure().energy
    for _ in sim.frames(20):
        assert sim.measure().energy <= 1.001 * start
