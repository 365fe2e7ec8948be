"""Simulation.set_positions: a jump is no motion, and what comes after it is like a beginning."""

import numpy as np
import pytest

from warp_contact import NeoHookean, Scene, Simulation, box

G = 9.81
SOFT = NeoHookean(1e5, 0.3, 1000.0, 1e-3)


def over_a_plate(gravity=(0.0, 0.0, 0.0), **settings) -> Simulation:
    """A block above a plate, which is fixed, and another one far away."""
    scene = Scene(gravity)
    scene.add_body(box((2.0, 2.0, 0.1), (2, 2, 1)), SOFT, fixed=True, label="plate")
    scene.add_body(box(0.3, 2), SOFT, (0.0, 0.0, 0.201), label="block")
    scene.add_body(box(0.3, 2), SOFT, (5.0, 0.0, 0.5), label="other")
    return Simulation(scene, **settings)


def run(sim: Simulation, frames: int) -> Simulation:
    for _ in sim.frames(frames):
        pass
    return sim


def test_an_episode_begins_anew(rng):
    sim = over_a_plate((0.0, 0.0, -G))
    x, v = sim.positions(), sim.velocities()
    run(sim, 5)
    before = sim.positions(2)
    x[sim._bodies.range(1)] += rng.uniform(1.0, 2.0, 3).astype(np.float32)
    start = x[sim._bodies.range(1)]
    sim.set_positions(1, start)
    np.testing.assert_array_equal(sim.positions(1), start)
    np.testing.assert_array_equal(sim.positions(2), before)  # nothing but the body moved
    sim.set_velocity(1, v[sim._bodies.range(1)])
    run(sim, 12)
    # A free fall, exact but for the rounding of positions of 1 m.
    t = 12 / sim.fps
    fallen = (start - sim.positions(1)).mean(axis=0)
    np.testing.assert_allclose(fallen, [0.0, 0.0, 0.5 * G * t * t], atol=1e-5)


def test_after_a_jump_nothing_is_left_of_the_contact_before():
    def on_a_floor(height: float) -> Simulation:
        scene = Scene((0.0, 0.0, -G))
        scene.add_plane((0.0, 0.0, 1.0))
        scene.add_body(box(0.3, 2), SOFT, (0.0, 0.0, 0.15 + height), label="block")
        return Simulation(scene)

    sim, fresh = run(on_a_floor(0.0), 10), on_a_floor(0.05)
    assert len(sim.contacts())
    sim.set_positions(0, fresh.positions(0))
    sim.set_velocity(0, (0.0, 0.0, 0.0))
    # Rounding, and the weight of half a step that is of another length.
    np.testing.assert_allclose(run(sim, 2).positions(0), run(fresh, 2).positions(0), atol=1e-6)


def test_all_bodies_and_some_vertices_can_be_set():
    sim = run(over_a_plate(), 1)
    x = sim.positions()[::-1].copy()
    sim.set_positions(None, x)
    np.testing.assert_array_equal(sim.positions(), x)
    sim.set_positions(1, np.ones((2, 3)), [0, 3])
    ids = np.arange(*sim.model.body_vert.numpy()[1:3])[[0, 3]]
    x[ids] = 1.0
    np.testing.assert_array_equal(sim.positions(), x)


def test_what_overlaps_after_a_jump_is_moved_apart_like_at_a_start(rng):
    down = rng.uniform(0.02, 0.1)

    def overlapping(sim: Simulation) -> Simulation:
        sim.set_positions(1, sim.positions(1) - np.float32([0.0, 0.0, down]))
        return sim

    late = run(overlapping(run(over_a_plate(), 3)), 20).measure()
    first = run(overlapping(over_a_plate()), 20).measure()
    assert late.unheld == first.unheld == 0 and late.overlap < 1e-3 * 0.15
    # The block rested: only the bits of the steps before, and their number, can be different.
    assert late.energy == pytest.approx(first.energy, rel=0.05, abs=1e-6)


def test_a_checkpoint_between_a_jump_and_the_next_frame(rng, tmp_path):
    sim = run(over_a_plate((0.0, 0.0, -G)), 3)
    sim.set_positions(1, sim.positions(1) - np.float32([0.0, 0.0, rng.uniform(0.02, 0.1)]))
    sim.save(tmp_path / "run.npz")
    other = over_a_plate((0.0, 0.0, -G))
    other.load(tmp_path / "run.npz")
    for one in (sim, other):
        run(one, 2)
    np.testing.assert_array_equal(sim.positions(), other.positions())
    np.testing.assert_array_equal(sim.velocities(), other.velocities())


def test_a_jump_through_a_plate_is_no_way_through_it(rng):
    sim = over_a_plate()
    sim.measure()
    below = sim.positions(1) - np.float32([*rng.uniform(-0.1, 0.1, 2), 0.8])
    sim.set_positions(1, below)
    assert sim.measure().tunnelled == 0
    run(sim, 2)
    assert sim.measure().tunnelled == 0
    # What goes on by motion from there counts.
    sim.state.x.assign(over_a_plate().positions())
    assert sim.measure().tunnelled > 0


def test_who_was_inside_a_body_that_jumped_did_not_go_through_it(rng):
    scene = Scene((0.0, 0.0, 0.0))
    scene.add_body(box(1.0, 2), SOFT)
    scene.add_body(box(0.3, 2), SOFT, (*rng.uniform(-0.1, 0.1, 2), 0.7))
    sim = Simulation(scene)

    def move(by: float) -> int:
        x = sim.positions()
        x[sim._bodies.range(0)] += np.float32([0.0, 0.0, by])
        sim.state.x.assign(x)
        return sim.measure().tunnelled

    sim.measure()
    assert move(0.15) == 0  # the lower half of the upper block is inside, close to the top
    jumped = sim.positions(0) + np.float32([0.0, 0.0, 0.8])
    sim.set_positions(0, jumped)  # now close to the bottom
    assert move(0.2) == 0


def test_what_slept_on_a_body_that_jumped_falls():
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    for k in range(2):
        scene.add_body(box(0.1, 2), NeoHookean(3e4, 0.3, 1000.0, 1e-2), (0, 0, 0.0502 + 0.1004 * k))
    sim = Simulation(scene, sleeping=True)
    asleep = sim._stepper.work.awake.bodies
    for _ in sim.frames(600):
        if not asleep.numpy().any():
            break
    assert not asleep.numpy().any()
    height = sim.positions(1)[:, 2].mean()
    sim.set_positions(0, sim.positions(0) + np.float32([1.0, 0.0, 0.0]))
    run(sim, 6)
    t = 6 / sim.fps
    fallen = height - sim.positions(1)[:, 2].mean()
    assert fallen == pytest.approx(0.5 * G * t * t, rel=0.1)  # it springs up a little at first


@pytest.mark.parametrize(
    ("body", "positions", "vertices", "message"),
    [
        (1, np.full((27, 3), np.nan), None, "positions of body 'block' .*: give finite numbers"),
        (1, np.zeros((26, 3)), None, r"body 'block' of shape \(26, 3\) .* of shape \(27, 3\)"),
        (1, np.zeros(3), [0], r"body 'block' .* of shape \(1, 3\)"),
        (None, np.zeros((27, 3)), None, r"positions of shape \(27, 3\) .* of shape \(72, 3\)"),
        (3, np.zeros((27, 3)), None, "no body 3: the scene has 3"),
        (-1, np.zeros((27, 3)), None, "no body -1: the scene has 3"),
        (1, np.zeros((1, 3)), [27], r"vertices of body 'block' \[27\]: give .* it names vertex 27"),
        (1, np.zeros((2, 3)), [0, 0], "vertices of body 'block' .* it names one twice"),
        (1, np.full((27, 3), 1e6), None, "body 'block' is 1e.06 m from the origin"),
        (None, np.full((72, 3), 1e6), None, "body 'plate' is 1e.06 m from the origin"),
        (None, np.zeros((1, 3)), [-1], r"vertices of the scene \[-1\]: give .* it names vertex -1"),
    ],
)
def test_positions_that_are_none_are_refused(body, positions, vertices, message):
    sim = over_a_plate()
    x = sim.positions()
    with pytest.raises(ValueError, match=message):
        sim.set_positions(body, positions, vertices)
    np.testing.assert_array_equal(sim.positions(), x)
