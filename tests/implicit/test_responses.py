"""Penalties and predicted forces where bodies are rigid or take implicit steps."""

import numpy as np
import pytest

import warp_contact as wc

G = 9.81
RIGID, SOFT = wc.Rigid(1000.0), wc.NeoHookean(1e6, 0.3, 1000.0, 1e-3)


def stack(response, *materials, **settings):
    """Blocks of 1 kg on each other and on the floor, a little turned and shifted."""
    scene = wc.Scene(friction=0.5)
    scene.add_plane((0.0, 0.0, 1.0))
    for k, material in enumerate(materials):
        place = (0.004 * k, 0.0, 0.0501 + 0.1001 * k)
        scene.add_body(wc.box(0.1, 2), material, place, (0.0, 0.0, 0.05 * k, 1.0))
    return wc.Simulation(scene, response, integrator="implicit", **settings)


def settled(sim, frames: int) -> list[float]:
    """Forces of the floor over the weight, in the last half of some frames; no energy is gained."""
    most, found = sim.measure().energy, []
    weight = G * float(sim.model.mass.numpy().sum())
    for _ in sim.frames(frames):
        now = sim.measure()
        # What the springs of a penalty store is not in it.
        assert now.energy < most + 1e-3
        found.append(now.forces.get(("body0", "plane0"), 0.0) / weight)
    return found[frames // 2 :]


def test_a_rigid_body_sinks_into_a_penalty_by_its_weight():
    sim = stack(wc.Penalty(2000.0, 2.0), RIGID)
    forces = settled(sim, 60)
    assert np.mean(forces) == pytest.approx(1.0, abs=2e-3)
    # Nine vertices, each by its share of the weight, from the resting gap of 1e-5 m on.
    assert sim.measure().overlap + 1e-5 == pytest.approx(G / 9.0 / 2000.0, rel=5e-3)
    assert np.abs(sim.velocities()).max() < 1e-3


@pytest.mark.parametrize("materials", [(RIGID,) * 3, (RIGID, SOFT, RIGID)])
@pytest.mark.parametrize("response", [wc.Penalty(1e5, 20.0), wc.PredictedForce()])
def test_a_stack_stands(response, materials):
    sim = stack(response, *materials)
    forces = settled(sim, 40)
    assert np.mean(forces) == pytest.approx(1.0, abs=1e-2)
    assert np.ptp(forces) < 0.1
    assert sim.measure().overlap < 5e-3 * 0.05
    assert np.abs(sim.pose(2)[0] - [0.008, 0.0, 0.25]).max() < 1e-3


# A penalty lets bodies sink in: friction across such a gap takes a part of the angular momentum.
@pytest.mark.parametrize(
    ("response", "friction"), [(wc.Penalty(2e3), 0.0), (wc.PredictedForce(), 0.4)]
)
def test_momenta_are_kept_in_a_collision(response, friction):
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0), friction=friction)
    scene.add_body(wc.box(0.1, 2), RIGID, velocity=(0.5, 0.0, 0.0))
    turned = (0.1, 0.2, 0.3, 0.9)
    scene.add_body(wc.box(0.1, 2), RIGID, (0.14, 0.03, 0.02), turned, angular_velocity=(0, 2, 1))
    sim = wc.Simulation(scene, response)
    start, most = sim.measure(), 0.0
    for _ in sim.frames(30):
        now = sim.measure()
        most = max(most, now.kinetic)
    assert sim.velocities(1)[:, 0].mean() > 0.1  # it was struck
    fastest = 1.0 * 0.5
    # Float32 velocities and positions.
    assert np.abs(now.momentum - start.momentum).max() < 1e-6 * fastest
    assert np.abs(now.angular_momentum - start.angular_momentum).max() < 5e-6 * fastest * 0.1
    assert most < 1.001 * start.kinetic


def test_a_penalty_gets_the_steps_that_the_inertia_asks_for():
    def tossed(inertia: float):
        light = wc.Rigid(mass=1.0, centre=(0, 0, 0), inertia=inertia * np.eye(3))
        scene = wc.Scene(gravity=(0.0, 0.0, -G))
        scene.add_plane((0.0, 0.0, 1.0))
        scene.add_body(wc.box(0.1, 2), light, (0.0, 0.0, 0.07), (0.1, 0.2, 0.0, 1.0))
        return wc.Simulation(scene, wc.Penalty(2e4))

    heavy, light = tossed(2e-3), tossed(2e-5)
    start = light.measure().energy
    most = max(light.measure().energy for _ in light.frames(20))
    heavy.step_frame()
    assert light.substeps > 4 * heavy.substeps
    # What the penalty stores comes back, but for the length of the step.
    assert most < 1.1 * start
