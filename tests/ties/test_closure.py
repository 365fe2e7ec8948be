"""Attached bodies that overlap: led apart by positions alone, like others."""

import numpy as np
import pytest

import warp_contact as wc

IRON = wc.Rigid(1000.0)
BAR = wc.box((0.04, 0.04, 0.1), (1, 1, 1))


def tilted(angle: float, axis: int) -> np.ndarray:
    return np.r_[np.sin(angle / 2) * np.eye(3)[axis], np.cos(angle / 2)]


def add_pair(scene: wc.Scene, speed: float, world: int = 0) -> None:
    """Two bars that hang together by a hinge, and one that is 0.012 m inside the first."""
    moving = {"velocity": (0.0, 0.3 * speed, -speed), "world": world}
    first = scene.add_body(BAR, IRON, (0.0, 0.0, 0.05), world=world)
    scene.add_body(BAR, IRON, (0.011, 0.004, 0.1), tilted(0.5, 0), **moving)
    other = scene.add_body(BAR, IRON, (0.012, 0.0, -0.03), tilted(0.4, 1), world=world)
    scene.attach(other, first, "hinge", at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0))


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_what_hangs_together_and_starts_inside_others_is_led_apart(speed):
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    add_pair(scene, speed)
    sim = wc.Simulation(scene)
    start = sim.measure()
    for _ in sim.frames(6):
        now = sim.measure()
        # What starts inside others and moves gains 3 % without a hinge too, by what turns it back.
        # At rest 1e-11 J is what rounding of the positions gives.
        assert now.kinetic <= 1.04 * start.kinetic + 1e-10
        # A millionth of the momenta, and of those at 1 mm/s.
        most = 1e-6 * 0.16 * max(speed, 1e-3)  # 0.16 kg
        np.testing.assert_allclose(now.momentum, start.momentum, atol=most)
        np.testing.assert_allclose(now.angular_momentum, start.angular_momentum, atol=0.1 * most)
    assert now.overlap < 1e-5 and start.overlap > 0.01


def test_a_thin_bar_on_a_hinge_between_others_is_led_apart():
    """It turns far in a step: with ties as they were when the step began the sweeps explode."""
    rng = np.random.default_rng(3)
    turns = rng.normal(size=(3, 4)) * (0.3, 0.3, 0.3, 1.0)
    thin = wc.box((0.02, 0.01, 0.1), (1, 1, 1))
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    first = scene.add_body(BAR, IRON, (0.0, 0.0, 0.05))
    scene.add_body(BAR, IRON, (*rng.uniform(-0.012, 0.012, 2), 0.1), turns[0])
    other = scene.add_body(thin, IRON, (0.012, 0.0, -0.03), turns[1])
    scene.attach(other, first, "hinge", at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0))
    scene.add_body(BAR, IRON, (*rng.uniform(-0.02, 0.02, 2), -0.1), turns[2])
    sim = wc.Simulation(scene)
    for _ in sim.frames(4):
        now = sim.measure()
        assert now.kinetic < 1e-8  # 0.5 kg at 0.2 mm/s: rounding
    assert now.overlap < 1e-5


def test_rigid_bodies_are_closed_as_if_nothing_were_attached_in_other_worlds():
    def positions(ties: bool) -> list[np.ndarray]:
        scene = wc.Scene()
        scene.add_plane((0.0, 0.0, 1.0), -0.1)
        for k in range(2):
            spin = (3.0, 5.0, 1.0)
            place = (0.01 * k, 0.0, 0.06 * k)
            scene.add_body(BAR, IRON, place, tilted(1.0, k), angular_velocity=spin, label=str(k))
        if ties:
            add_pair(scene, 0.5, world=1)
        sim = wc.Simulation(scene)
        return [np.concatenate([sim.positions("0"), sim.positions("1")]) for _ in sim.frames(20)]

    np.testing.assert_array_equal(positions(ties=True), positions(ties=False))


def test_ties_that_were_closed_are_left_alone_when_other_worlds_are_closed_again():
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    add_pair(scene, 0.0)
    sim = wc.Simulation(scene, fps=3840, substeps=1)
    start = sim.positions()
    sim.step_frame()
    assert np.abs(sim.positions() - start).max() > 1e-4  # it was closed
    assert not sim._stepper.work.ties.ties.moved.numpy().any()
