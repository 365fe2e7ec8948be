"""Contacts whose directions turn: a floor that tilts, a wheel that begins to roll."""

import numpy as np
import pytest

from warp_contact import NeoHookean, Scene, Simulation, box, cylinder

G = 9.81
RUBBER = NeoHookean(2e5, 0.3, 1000.0, 2e-3)


def tilting(friction: float) -> Simulation:
    """A block on a floor that is held."""
    scene = Scene(friction=friction)
    scene.add_body(box((0.6, 0.3, 0.1), (6, 3, 1)), RUBBER, fixed=True, label="floor")
    scene.add_body(box((0.1, 0.1, 0.05), (2, 2, 1)), RUBBER, (0.0, 0.0, 0.0751), label="block")
    return Simulation(scene)


def turn_on(sim: Simulation, start: np.ndarray, rate: float) -> tuple[float, float]:
    """A frame of a floor that turns about y at a rate [1/s]: its angle, and where the block is.

    Along the floor [m]. Its vertices go straight to where they have to be after the frame.
    """
    angle = rate * (sim.frame + 1) / sim.fps
    c, s = np.cos(angle), np.sin(angle)
    turned = start @ np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    sim.set_velocity(0, (turned - sim.positions(0)) * sim.fps)
    sim.step_frame()
    return angle, float(sim.positions(1).mean(axis=0) @ [c, 0.0, -s])


def test_a_block_on_a_floor_that_tilts_slides_when_it_is_steeper_than_the_friction():
    friction, rate = 0.3, 0.5  # it takes 0.58 s to arctan 0.3
    sim = tilting(friction)
    start = sim.positions(0).astype(float)
    sticks, slides = [], []
    for _ in range(60):
        angle, along = turn_on(sim, start, rate)
        if angle < np.arctan(friction) - 0.06:
            sticks.append(along)
        slides.append((angle / rate, along))
    # The block bends by 0.04 mm; it would have slid by millimetres.
    assert np.ptp(sticks) < 1e-4
    # From the angle of friction on it gains g (sin - friction cos) of speed.
    t = np.linspace(np.arctan(friction) / rate, 1.0, 2001)
    speed = np.cumsum(G * (np.sin(rate * t) - friction * np.cos(rate * t))) * (t[1] - t[0])
    way = np.sum(speed) * (t[1] - t[0])
    print(slides[-1], way)
    assert abs(slides[-1][1]) == pytest.approx(way, rel=0.1)  # it swings as it comes loose


def test_a_wheel_that_slides_begins_to_roll_at_two_thirds_of_its_speed():
    """Whatever the friction is, as long as it slides."""
    radius, speed = 0.1, 1.0
    wheel = cylinder(radius, 0.05, 4, 1).transformed([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    scene = Scene(friction=0.4)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    height = 1e-5 - wheel.vertices[:, 2].min()
    scene.add_body(wheel, RUBBER, (0.0, 0.0, height), velocity=(speed, 0.0, 0.0))
    sim = Simulation(scene)
    x, mass = sim.positions().astype(float), sim.model.mass.numpy().astype(float)
    r2 = mass @ ((x - x.mean(axis=0))[:, [0, 2]] ** 2).sum(axis=1) / mass.sum()
    speeds = [sim.measure().momentum[0] / mass.sum() for _ in sim.frames(12)]
    # It slides for 0.09 s; a wheel of 24 sides then loses some percent on its edges.
    rolling = speed / (1.0 + r2 / radius**2)
    assert np.mean(speeds[6:]) == pytest.approx(rolling, rel=0.05)
    r = sim.positions() - sim.positions().mean(axis=0)
    spin = mass @ np.cross(r, sim.velocities() - sim.velocities().mean(axis=0))[:, 1]
    assert spin == pytest.approx(mass.sum() * r2 * speeds[-1] / radius, rel=0.1)
