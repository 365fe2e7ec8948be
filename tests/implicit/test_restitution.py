"""Restitution against closed forms: what bounces, how high, and what energy is left."""

import numpy as np
import pytest

import warp_contact as wc

G, EDGE, HEIGHT = 9.81, 0.1, 0.5
BALL, BOX = wc.sphere(0.05, 147), wc.box(EDGE, 2)  # its lowest point is below its centre
SOLID = wc.Rigid(1000.0)


def dropped(mesh, restitution, material=SOLID, height=HEIGHT, **settings) -> wc.Simulation:
    """A body that falls onto a plane; of the mesh the lowest point is at the height."""
    scene = wc.Scene(friction=0.3, restitution=restitution)
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(mesh, material, (0.0, 0.0, height - mesh.vertices[:, 2].min()))
    return wc.Simulation(scene, **settings)


def energy(sim: wc.Simulation) -> float:
    """Kinetic, elastic and potential energy of all bodies [J]."""
    now, mass = sim.measure(), sim.model.mass.numpy().astype(float)
    total = now.kinetic + now.elastic
    for body in range(sim.model.n_body):
        own = sim.model.vert_body.numpy() == body
        total += G * mass[own].sum() * sim._centre(body, sim.positions(body))[2]
    return total


def reached(sim: wc.Simulation, frames: int) -> np.ndarray:
    """Height of fall [m] that the energy after each frame is worth, of a single body."""
    rest = -sim.scene.bodies[0].mesh.vertices[:, 2].min()
    weight = G * sim.model.mass.numpy().sum()
    return np.array([energy(sim) / weight - rest for _ in sim.frames(frames)])


@pytest.mark.parametrize("substeps", [None, 16])
@pytest.mark.parametrize("e", [0.3, 0.5, 0.8, 1.0])
def test_a_ball_bounces_to_e_squared_of_its_height_again_and_again(e, substeps):
    heights = reached(dropped(BALL, e, substeps=substeps), 110)
    heights = heights[heights > 2e-3]  # lower ones are close to what counts as rest
    n = np.rint(np.log(heights / HEIGHT) / (2.0 * np.log(e))) if e < 1.0 else 0.0 * heights
    assert e == 1.0 or n.max() >= 2
    # The sweeps end at 1e-5 of an edge: 1e-4 of the speeds, more of slow ones.
    np.testing.assert_allclose(heights, HEIGHT * e ** (2.0 * n), rtol=5e-3)


def test_between_two_the_mean_of_both_coefficients_counts():
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0), restitution=0.2)
    at = 0.0, 0.0, HEIGHT - BALL.vertices[:, 2].min()
    scene.add_body(BALL, SOLID, at, restitution=0.8)
    assert reached(wc.Simulation(scene), 30)[-1] == pytest.approx(0.25 * HEIGHT, rel=2e-3)


@pytest.mark.parametrize("e", [0.5, 1.0])
def test_a_box_that_lands_flat_keeps_no_spin(e):
    sim = dropped(BOX, e, height=0.2)
    heights = reached(sim, 24)
    assert heights[-1] == pytest.approx(0.2 * e * e, rel=2e-3)
    v = sim.velocities(0)
    assert np.ptp(v, axis=0).max() < 1e-6 * np.abs(v).max()  # rounding


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_a_ball_that_strikes_an_equal_one_hands_over_its_speed(e):
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=0.0, restitution=e)
    scene.add_body(BALL, SOLID, velocity=(1.0, 0.0, 0.0))
    scene.add_body(BALL, SOLID, (0.13, 0.0, 0.0))
    sim = wc.Simulation(scene)
    for _ in sim.frames(10):
        pass
    after = [sim.velocities(body).mean(axis=0) for body in (0, 1)]
    wanted = [[0.5 - 0.5 * e, 0.0, 0.0], [0.5 + 0.5 * e, 0.0, 0.0]]
    np.testing.assert_allclose(after, wanted, atol=1e-3)  # of facets, and of the sweeps


def test_friction_acts_by_both_parts_of_the_impulse():
    mu, e, speed = 0.1, 0.6, 3.0
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=mu, restitution=e)
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(BALL, SOLID, (0.0, 0.0, 0.06), velocity=(2.0, 0.0, -speed))
    sim = wc.Simulation(scene)
    for _ in sim.frames(4):
        pass
    centre = np.average(sim.velocities(0), axis=0, weights=sim.model.mass.numpy())
    wanted = [2.0 - mu * (1.0 + e) * speed, 0.0, e * speed]
    np.testing.assert_allclose(centre, wanted, atol=2e-2)  # it spins, and its lowest point is one


def tumbling(rng, e: float, friction: float) -> wc.Simulation:
    """Two boxes that spin and strike each other."""
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=friction, restitution=e)
    turns, w = rng.normal(size=(2, 4)), 3.0 * rng.normal(size=(2, 3))
    aside = [0.22, *rng.uniform(-0.04, 0.04, 2)]
    scene.add_body(BOX, SOLID, (0, 0, 0), turns[0], (1.0, 0.0, 0.0), angular_velocity=w[0])
    scene.add_body(BOX, wc.Rigid(2000.0), aside, turns[1], angular_velocity=w[1])
    return wc.Simulation(scene)


def test_momentum_stays_and_energy_never_rises(rng):
    for _ in range(3):
        sim = tumbling(rng, rng.uniform(0.0, 1.0), rng.uniform(0.0, 1.0))
        start = last = sim.measure()
        for _ in sim.frames(30):
            now = sim.measure()
            off = np.abs(now.momentum - start.momentum).max()
            assert off < 1e-6 * np.abs(start.momentum).max()
            assert now.kinetic < last.kinetic + 1e-5 * start.kinetic  # rounding
            last = now


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_angular_momentum_stays_where_no_vertex_crosses_a_triangle_in_a_step(seed):
    sim = tumbling(np.random.default_rng(seed), 0.7, 0.5)
    start = sim.measure()
    for _ in sim.frames(30):
        away = np.abs(sim.measure().angular_momentum - start.angular_momentum).max()
        assert away < 1e-6 * np.abs(start.momentum).max() * EDGE
    lost = 1.0 - sim.measure().kinetic / start.kinetic
    assert 0.02 < lost < 0.6  # they have struck


def test_a_box_that_tumbles_without_loss_gains_no_energy(rng):
    """It is stopped as it lies before a step and parts as it lies after it."""
    for _ in range(3):
        scene = wc.Scene(friction=0.0, restitution=1.0)
        scene.add_plane((0.0, 0.0, 1.0))
        turn, w = rng.normal(size=4), 4.0 * rng.normal(size=3)
        scene.add_body(wc.box((0.1, 0.07, 0.05), 2), SOLID, (0, 0, 0.2), turn, angular_velocity=w)
        sim = wc.Simulation(scene)
        energies = np.array([energy(sim), *(energy(sim) for _ in sim.frames(60))])
        assert energies.max() < 1.001 * energies[0]
        assert energies[-1] > 0.7 * energies[0]  # several impacts at once lose some


def pile(rng, most: float) -> wc.Simulation:
    """Boxes and balls that fall on each other, each with a coefficient up to the most."""
    scene = wc.Scene(friction=rng.uniform(0.0, 0.8))
    scene.add_plane((0.0, 0.0, 1.0), restitution=rng.uniform(0.0, most))
    for k in range(5):
        mesh = wc.box(0.1 * rng.uniform(0.4, 1.0, 3), 1) if k % 2 else BALL
        at = [*rng.uniform(-0.04, 0.04, 2), 0.09 + 0.13 * k]
        v, w, e = rng.normal(size=3), 4.0 * rng.normal(size=3), rng.uniform(0.0, most)
        weighs = wc.Rigid(rng.uniform(300.0, 3000.0))
        given = {"velocity": 0.5 * v, "angular_velocity": w, "restitution": e}
        scene.add_body(mesh, weighs, at, rng.normal(size=4), **given)
    return wc.Simulation(scene)


def test_the_energy_of_a_pile_never_rises(rng):
    sim = pile(rng, 1.0)
    start = last = energy(sim)
    for _ in sim.frames(60):
        now = energy(sim)
        assert now < last + 1e-3 * start
        last = now


@pytest.mark.parametrize("speed", [0.3, 1.0, 3.0])
def test_a_body_of_ten_micrometres_bounces_as_a_larger_one(speed):
    """Its energy and impulses, and their squares, are tiny in float32."""
    found = []
    for size in 1.0, 1e-5:
        scene = wc.Scene(gravity=(0.0, 0.0, 0.0), restitution=1.0)
        scene.add_body(wc.box(size, 1), SOLID, velocity=(0.0, 0.0, -speed * size))
        for up in 1.0, -1.0:
            scene.add_plane((0.0, 0.0, up), -0.6 * size)
        sim = wc.Simulation(scene)
        first = sim.measure().kinetic
        for _ in sim.frames(60):
            pass
        found.append(sim.measure().kinetic / first)
    assert max(found) < 1.0 + 1e-6
    assert found[0] == pytest.approx(found[1], rel=1e-3)


def test_what_bounces_comes_to_rest():
    sim = dropped(BOX, 0.5, height=0.1)
    for _ in sim.frames(60):
        pass
    at = sim.positions()
    for _ in sim.frames(30):
        assert np.abs(sim.velocities()).max() < 1e-5
        weight = G * sim.model.mass.numpy().sum()
        assert sim.force_on(0)[2] == pytest.approx(weight, rel=1e-4)
    assert np.abs(sim.positions() - at).max() < 1e-6


def test_a_stack_at_rest_does_not_feel_it():
    def stack(e: float):
        scene = wc.Scene(friction=0.5, restitution=e)
        scene.add_plane((0.0, 0.0, 1.0))
        for k in range(3):
            scene.add_body(BOX, SOLID, (0.004 * k, 0.0, 0.05 + 0.1 * k))
        sim = wc.Simulation(scene)
        for _ in sim.frames(20):
            pass
        return sim.positions()

    np.testing.assert_array_equal(stack(0.0), stack(0.7))


def test_forces_are_the_change_of_momentum():
    sim, received = dropped(BALL, 0.7, height=0.1), 0.0
    for _ in sim.frames(40):
        received += sim.force_on(0)[2] / sim.fps
        pair = sim.forces().get(("body0", "plane0"))
        assert sim.force_on(0)[2] == pytest.approx(pair.total[2] if pair else 0.0, rel=1e-5)
    gained = sim.measure().momentum[2] + sim.model.mass.numpy().sum() * G * 40 / sim.fps
    assert received == pytest.approx(gained, rel=1e-5)


@pytest.mark.parametrize("e", [0.5, 1.0])
def test_a_very_stiff_body_bounces_as_a_rigid_one(e):
    stiff = wc.NeoHookean(1e9, 0.3, 1000.0)
    heights = reached(dropped(BOX, e, stiff, 0.2, integrator="implicit"), 24)
    assert heights[-1] == pytest.approx(0.2 * e * e, rel=1e-2)  # what its vibrations keep


@pytest.mark.parametrize("e", [0.5, 1.0])
def test_energy_does_not_rise_where_a_rigid_ball_falls_on_a_soft_block(e):
    scene = wc.Scene(friction=0.3, restitution=e)
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(BOX, wc.NeoHookean(1e5, 0.3, 1000.0, 2e-3), (0.0, 0.0, 0.0501))
    scene.add_body(BALL, SOLID, (0.01, 0.0, 0.25))
    sim = wc.Simulation(scene)
    start = last = energy(sim)
    for _ in sim.frames(60):
        now = energy(sim)
        assert now < last + 1e-3 * start
        last = now
    assert sim.measure().overlap < 1e-3 * 0.05


def test_bodies_that_are_welded_bounce_as_one():
    scene = wc.Scene(friction=0.0, restitution=0.5)
    scene.add_plane((0.0, 0.0, 1.0))
    low = scene.add_body(BOX, SOLID, (0.0, 0.0, 0.05 + 0.2))
    high = scene.add_body(BOX, SOLID, (0.0, 0.0, 0.15 + 0.2))
    held = scene.attach(high, low)
    sim, received = wc.Simulation(scene), 0.0
    for _ in sim.frames(20):
        received += sim.attachment_force(held)[2] / sim.fps
    mass = sim.model.mass.numpy().sum()
    left = energy(sim) - mass * G * 0.1
    assert left == pytest.approx(0.25 * mass * G * 0.2, rel=5e-3)
    own = 0.5 * mass
    gained = own * (sim.velocities(high)[:, 2].mean() + G * 20 / sim.fps)
    assert received == pytest.approx(gained, rel=1e-3)
