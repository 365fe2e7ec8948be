"""Motors that lead to a place, and the places of hinges and sliders."""

import numpy as np
import pytest

import warp_contact as wc
from warp_contact.scene.scene import rotation_matrix

G, BOX, SOLID = 9.81, wc.box(0.1, 2), wc.Rigid(1000.0)  # of 1 kg
NONE = (0.0, 0.0, 0.0)
UP = (0.0, 0.0, 1.0)


def on_slider(gravity: float = G):
    """A body of 1 kg on a vertical slider."""
    scene = wc.Scene((0.0, 0.0, -gravity))
    scene.add_body(BOX, SOLID, UP)
    held = scene.attach(0, kind="slider", at=UP, axis=UP)
    return wc.Simulation(scene), held


def on_hinge():
    """A body that hangs from a level axis, with its centre 0.1 m away along x."""
    scene = wc.Scene()
    arm = scene.add_body(BOX, SOLID, (0.1, 0.0, 0.0))
    base = scene.add_body(BOX, SOLID, (0.0, 0.0, -0.2), fixed=True)
    held = scene.attach(arm, base, kind="hinge", at=NONE, axis=(0.0, 1.0, 0.0))
    return wc.Simulation(scene), held


def places(sim: wc.Simulation, held, frames: int) -> list[float]:
    """Where it is after each of the frames."""
    return [sim.attachment_position(held) for _ in sim.frames(frames)]


def test_a_slider_comes_to_its_target_at_its_speed_and_holds_the_weight_there():
    sim, held = on_slider()
    assert sim.attachment_position(held) == 0.0
    sim.set_motor(held, 0.2, 20.0, target=0.05)
    way = places(sim, held, 30)
    # Positions near 1 m are rounded to 6e-8 m, of a way of 3e-3 m a frame.
    assert max(np.diff(way)) == pytest.approx(0.2 / 60.0, rel=1e-3)
    assert max(way) <= 0.05 + 1e-6 and way[-1] == pytest.approx(0.05, abs=1e-6)
    assert sim.pose(0)[0][2] - 1.0 == pytest.approx(0.05, abs=1e-6)
    assert sim.motor_force(held) == pytest.approx(G, rel=1e-5)


@pytest.mark.parametrize("limit", [0.5, 5.0])
def test_a_weak_motor_brakes_in_time(limit):
    """It could not stop at the target if it went on at its speed until it was there."""
    sim, held = on_slider(gravity=0.0)
    sim.set_motor(held, 1.0, limit, target=0.3)
    way = places(sim, held, 150)
    assert max(way) <= 0.3 + 1e-5 and way[-1] == pytest.approx(0.3, abs=1e-6)
    # Half of the limit slows it down, in steps: the last ones go to the target itself.
    assert np.diff(way, 2).min() >= -(0.5 * limit / 60.0**2) * 1.2 - 1e-6


def test_a_hinge_counts_whole_turns_and_holds_by_the_torque_of_statics():
    sim, held = on_hinge()
    for target in 1.0, 7.5, -0.5:
        sim.set_motor(held, -4.0, 2.0, target=target)  # of a speed only the size counts
        way = places(sim, held, 150)
        assert way[-1] == pytest.approx(target, abs=1e-5)
        assert np.abs(np.diff(way)).max() <= 4.0 / 60.0 * 1.001
        place = 0.1 * np.cos(target), 0.0, -0.1 * np.sin(target)
        np.testing.assert_allclose(sim.pose(0)[0], place, atol=1e-6)
        # The mean of a frame in which rounding moves it; 2e-4 of it so far.
        assert sim.motor_force(held) == pytest.approx(-G * 0.1 * np.cos(target), rel=2e-3)


@pytest.mark.parametrize("axis", [(0.7706, 0.6369, -0.0216), None])  # no small pivot by the first
def test_two_free_bodies_turn_by_the_target_against_each_other(axis, rng):
    scene = wc.Scene(NONE)
    a = scene.add_body(BOX, SOLID)
    b = scene.add_body(BOX, wc.Rigid(2000.0), (0.15, 0.0, 0.0))
    axis = rng.normal(size=3) if axis is None else np.array(axis)
    axis /= np.linalg.norm(axis)
    held = scene.attach(a, b, kind="hinge", at=(0.07, 0.0, 0.0), axis=axis)
    sim = wc.Simulation(scene)
    sim.set_motor(held, 2.0, 0.5, target=-1.2)
    places(sim, held, 90)
    one, other = (rotation_matrix(sim.pose(body)[1]) for body in (a, b))
    turn = other.T @ one
    sine = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    angle = np.arctan2(0.5 * sine @ axis, 0.5 * (np.trace(turn) - 1.0))
    assert angle == pytest.approx(-1.2, abs=2e-5)  # of positions in float32, 5e-6 of their arms
    assert sim.attachment_position(held) == pytest.approx(-1.2, abs=2e-5)
    # It stands still with what turned it: nothing came from outside, to the rounding of float32.
    now, mass, speed = sim.measure(), 3.0, 2.0 * 0.1
    assert np.abs(sim.velocities()).max() < 1e-4
    assert np.abs(now.momentum).max() < 1e-6 * mass * speed
    assert np.abs(now.angular_momentum).max() < 1e-6 * mass * speed * 0.1


def test_what_is_in_the_way_feels_the_limit_until_it_is_gone():
    scene = wc.Scene(NONE)
    scene.add_body(BOX, SOLID, (0.0, 0.0, 0.2))
    block = scene.add_body(BOX, SOLID, (0.0, 0.0, 0.051), fixed=True)
    held = scene.attach(0, kind="slider", at=(0.0, 0.0, 0.2), axis=UP)
    sim = wc.Simulation(scene)
    sim.set_motor(held, 0.5, 7.0, target=-0.1)
    places(sim, held, 30)
    assert sim.motor_force(held) == pytest.approx(-7.0, rel=1e-3)
    assert sim.force_on(block)[2] == pytest.approx(-7.0, rel=1e-2)
    sim.set_velocity(block, (0.0, 0.0, -0.3))
    way = places(sim, held, 30)
    assert way[-1] == pytest.approx(-0.1, abs=1e-5) and min(way) > -0.1 - 1e-3


def test_a_target_is_kept_in_a_checkpoint_and_forgotten_by_a_reset(tmp_path):
    sim, held = on_hinge()
    sim.set_motor(held, 8.0, 2.0, target=9.0)
    places(sim, held, 60)  # one turn and a part
    assert sim.attachment_position(held) > 2.0 * np.pi
    sim.save(tmp_path / "on.npz")
    places(sim, held, 30)
    after = sim.positions()
    other, held = on_hinge()
    other.load(tmp_path / "on.npz")
    assert other.attachment_position(held) > 2.0 * np.pi
    places(other, held, 30)
    assert other.positions().tobytes() == after.tobytes()
    other.reset()
    assert other.attachment_position(held) == pytest.approx(0.0, abs=1e-6)
    places(other, held, 10)
    assert other.motor_force(held) == 0.0


def test_what_has_no_place_and_no_speed_is_refused_by_name():
    sim, held = on_slider()
    for wrong in np.nan, np.inf, "up":
        with pytest.raises(ValueError, match="target"):
            sim.set_motor(held, 1.0, 1.0, target=wrong)
    with pytest.raises(ValueError, match="give a speed that leads to the target"):
        sim.set_motor(held, 0.0, 1.0, target=1.0)
    scene = wc.Scene()
    scene.add_body(BOX, SOLID)
    weld = scene.attach(0, kind="weld", label="glue", at=NONE)
    with pytest.raises(ValueError, match="'glue' is a weld: only a hinge or a slider"):
        wc.Simulation(scene).attachment_position(weld)


def test_a_motor_without_hold_is_refused_but_may_be_switched_off():
    sim, held = on_slider()
    sim.detach(held)
    with pytest.raises(ValueError, match="'attachment0' is broken or let go"):
        sim.set_motor(held, 1.0, 1.0)
    sim.set_motor(held, 0.0, 0.0)
