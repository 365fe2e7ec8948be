"""Simulation.reset: the next episode gives the bits of the first one."""

import numpy as np
import pytest

from warp_contact import NeoHookean, Penalty, Scene, Simulation, box

SOFT = NeoHookean(1e5, 0.35, 1000.0, 4e-3)


def worlds(response=None, **settings) -> Simulation:
    """Two worlds of two blocks that fall on each other, beside a driven lid."""
    scene = Scene(friction=0.5)
    scene.add_plane((0.0, 0.0, 1.0))
    for world in range(2):
        for k in range(2):
            place = (0.01 * k, 0.0, 0.051 + 0.12 * k)
            scene.add_body(box(0.1, 2), SOFT, place, velocity=(0.1, 0.0, -0.5), world=world)
    scene.add_body(box(0.1, 1), SOFT, (0.0, 0.0, 0.5), fixed=True, label="lid")
    return Simulation(scene, response, **settings)


def episode(sim: Simulation, frames: int = 20) -> list[np.ndarray]:
    seen = []
    for _ in sim.frames(frames):
        now = sim.measure()
        seen.append(np.r_[sim.positions().ravel(), sim.velocities().ravel(), sim.substeps])
        seen.append(np.array([now.energy, now.overlap, now.n_contacts, *now.forces.values()]))
    return seen


@pytest.mark.parametrize("settings", [{}, {"sleeping": True}, {"response": Penalty(2e3)}], ids=str)
def test_the_next_episode_has_the_bits_of_the_first(settings, rng):
    sim = worlds(**settings)
    first = episode(sim)
    sim.set_velocity("lid", (0.0, 0.0, -1.0))
    sim.set_positions(0, sim.positions(0) + np.float32(rng.uniform(0.0, 0.01, 3)))
    episode(sim, 3)
    sim.reset()
    assert sim.frame == 0 and sim.time == 0.0 and sim.substeps == 0
    assert sim.measure().forces == {} and sim.measure().tunnelled == 0
    for one, other in zip(first, episode(sim), strict=True):
        np.testing.assert_array_equal(one, other)


def test_one_world_begins_anew_while_the_other_goes_on():
    sim, other = worlds(), worlds()
    start = sim.positions()
    episode(sim, 10)
    episode(other, 10)
    sim.reset([1])
    assert sim.frame == 10
    for body in (2, 3):
        np.testing.assert_array_equal(sim.positions(body), start[sim._bodies.range(body)])
        np.testing.assert_array_equal(sim.velocities(body), np.float32([[0.1, 0.0, -0.5]] * 27))
    episode(sim, 8)
    episode(other, 8)
    fresh = worlds()
    episode(fresh, 8)
    for body in (2, 3):
        np.testing.assert_array_equal(sim.positions(body), fresh.positions(body))
        np.testing.assert_array_equal(sim.velocities(body), fresh.velocities(body))
    for body in (0, 1):
        np.testing.assert_array_equal(sim.positions(body), other.positions(body))


def test_a_world_without_a_body_is_refused():
    with pytest.raises(ValueError, match="no body is in world 7"):
        worlds().reset([7])
