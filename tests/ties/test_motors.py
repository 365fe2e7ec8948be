"""Motors of hinges and sliders against closed forms."""

import numpy as np
import pytest

import warp_contact as wc

G, MASS, BOX, SOLID = 9.81, 1.0, wc.box(0.1, 2), wc.Rigid(1000.0)
STEP = 1.0 / 240.0  # [s]
NONE = (0.0, 0.0, 0.0)


def lift(limit: float, velocity: float = 0.2, frames: int = 40):
    """A body on a vertical slider, and its motor; after some frames."""
    scene = wc.Scene()
    scene.add_body(BOX, SOLID, (0.0, 0.0, 1.0))
    held = scene.attach(0, kind="slider", at=(0.0, 0.0, 1.0), axis=(0.0, 0.0, 1.0))
    sim = wc.Simulation(scene)
    sim.set_motor(held, velocity, limit)
    for _ in sim.frames(frames):
        pass
    return sim, held


def spin(sim: wc.Simulation, body: int, axis=2) -> float:
    """Angular velocity about an axis [1/s]."""
    x, v = (a.astype(float) for a in (sim.positions(body), sim.velocities(body)))
    r, u = x - x.mean(axis=0), v - v.mean(axis=0)
    flat = np.delete(r, axis, axis=1)  # across the axis
    return np.cross(r, u).sum(axis=0)[axis] / np.square(flat).sum()


def test_a_slider_lifts_a_mass_at_its_speed_by_its_weight():
    sim, held = lift(20.0)
    v = sim.velocities(0).mean(axis=0)
    np.testing.assert_allclose(v, [0.0, 0.0, 0.2], atol=1e-5)
    assert sim.motor_force(held) == pytest.approx(G * MASS, rel=1e-5)
    assert np.abs(sim.attachment_force(held)).max() < 1e-3
    # It accelerates by 20 N / 1 kg - g first.
    late = 0.5 * 0.2**2 / (20.0 / MASS - G)
    assert sim.pose(0)[0][2] - 1.0 == pytest.approx(0.2 * 40 / 60 - late, abs=0.2 * STEP)


def test_a_slider_that_is_too_weak_sinks_by_what_is_lacking():
    sim, held = lift(5.0)
    assert sim.motor_force(held) == pytest.approx(5.0, rel=1e-6)
    # A force begins with a step, half of which was before the start.
    wanted = (5.0 / MASS - G) * 40 / 60
    assert sim.velocities(0)[:, 2].mean() == pytest.approx(wanted, abs=1.1 * 5.0 * STEP / 2)


def test_a_hinge_comes_to_its_speed_by_its_torque():
    scene = wc.Scene(gravity=NONE)
    scene.add_body(BOX, SOLID)
    held = scene.attach(0, kind="hinge", at=(0.07, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
    sim = wc.Simulation(scene)
    sim.set_motor(held, 3.0, 0.05)
    inertia = MASS * (0.1**2 / 6.0 + 0.07**2)
    for k in sim.frames(60):
        if k == 10:
            assert sim.motor_force(held) == pytest.approx(0.05, rel=1e-6)
            wanted = 0.05 / inertia * (10 / 60)
            assert spin(sim, 0) == pytest.approx(wanted, abs=0.05 / inertia * STEP)
    assert spin(sim, 0) == pytest.approx(3.0, rel=1e-3)
    assert abs(sim.motor_force(held)) < 1e-3


@pytest.mark.parametrize("kind", ["slider", "hinge"])
def test_momentum_stays_where_a_motor_drives_two_bodies_apart(kind):
    scene = wc.Scene(gravity=NONE)
    a = scene.add_body(BOX, SOLID)
    b = scene.add_body(BOX, wc.Rigid(2000.0), (0.15, 0.0, 0.0))
    held = scene.attach(a, b, kind=kind, at=(0.07, 0.0, 0.0), axis=(0.6, 0.0, 0.8))
    sim = wc.Simulation(scene)
    sim.set_motor(held, 1.0, 0.5)
    for _ in sim.frames(20):
        pass
    now = sim.measure()
    v = [sim.velocities(body) for body in (a, b)]
    size = 3.0 * max(np.abs(u).max() for u in v)
    assert size > 0.1
    # What ties hold twice, such as the distance of two points, they round; a motor does not.
    assert np.abs(now.momentum).max() < 2e-5 * size
    assert np.abs(now.angular_momentum).max() < 2e-5 * size * 0.15


def test_what_it_presses_on_feels_its_limit():
    scene = wc.Scene(gravity=NONE)
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(BOX, SOLID, (0.0, 0.0, 0.06))
    held = scene.attach(0, kind="slider", at=(0.0, 0.0, 0.06), axis=(0.0, 0.0, -1.0))
    sim = wc.Simulation(scene)
    sim.set_motor(held, 0.1, 7.0)
    for _ in sim.frames(20):
        assert sim.force_on(0)[2] < 7.0 * 1.5  # and no more when it arrives, but what it brings
    assert sim.force_on(0)[2] == pytest.approx(7.0, rel=1e-3)
    assert sim.motor_force(held) == pytest.approx(7.0, rel=1e-3)
    assert np.abs(sim.velocities(0)).max() < 1e-3
    sim.set_motor(held, -0.1, 7.0)
    for _ in sim.frames(10):
        pass
    assert sim.velocities(0)[:, 2].mean() == pytest.approx(0.1, rel=1e-3)


def test_a_load_is_lifted_at_the_same_speed():
    scene = wc.Scene(friction=0.5)
    plate = scene.add_body(wc.box((0.2, 0.2, 0.05), 2), SOLID)
    load = scene.add_body(BOX, SOLID, (0.0, 0.0, 0.0751))
    held = scene.attach(plate, kind="slider", at=NONE, axis=(0.0, 0.0, 1.0))
    sim = wc.Simulation(scene)
    sim.set_motor(held, 0.1, 200.0)
    for _ in sim.frames(30):
        pass
    for body in plate, load:
        assert sim.velocities(body)[:, 2].mean() == pytest.approx(0.1, rel=1e-2)
    weight = G * 0.2 * 0.2 * 0.05 * 1000.0
    assert sim.motor_force(held) == pytest.approx(weight + G * MASS, rel=1e-3)
    assert sim.forces()["body0", "body1"].total[2] == pytest.approx(-G * MASS, rel=1e-3)


def test_its_speed_is_that_against_the_other_body():
    scene = wc.Scene(gravity=NONE)
    base = scene.add_body(BOX, SOLID, fixed=True)
    arm = scene.add_body(BOX, SOLID, (0.0, 0.0, 0.2))
    held = scene.attach(arm, base, kind="hinge", at=(0.0, 0.0, 0.1), axis=(0.0, 0.0, 1.0))
    sim = wc.Simulation(scene)
    sim.set_motor(held, 2.0, 1.0)
    for k in sim.frames(20):
        turn = 0.5 * (k + 1) / 60.0  # 1 rad/s
        sim.move_to(base, pose=(NONE, (0.0, 0.0, np.sin(turn), np.cos(turn))))
    assert spin(sim, arm) == pytest.approx(3.0, rel=1e-2)


def test_a_run_goes_on_from_a_checkpoint_and_begins_anew_with_the_same_bits(tmp_path):
    def walk(sim, frames):
        for _ in sim.frames(frames):
            pass
        return sim.positions()

    one, other = (lift(20.0, frames=0) for _ in range(2))
    first = walk(one[0], 6)
    one[0].save(tmp_path / "one.npz")
    last = walk(one[0], 6)
    other[0].set_motor(other[1], 0.0, 0.0)
    other[0].load(tmp_path / "one.npz")
    np.testing.assert_array_equal(walk(other[0], 6), last)
    one[0].reset()
    still = walk(one[0], 6)  # without the motor
    assert still[:, 2].mean() < 1.0
    one[0].reset()
    one[0].set_motor(one[1], 0.2, 20.0)
    np.testing.assert_array_equal(walk(one[0], 6), first)


def test_an_arm_holds_itself_by_the_torques_of_statics():
    scene, link = wc.Scene(), wc.box((0.2, 0.04, 0.04), (4, 1, 1))
    held, before = [], None
    for k in range(3):
        body = scene.add_body(link, SOLID, (0.1 + 0.22 * k, 0.0, 1.0))
        place = {"at": (0.22 * k - 0.01, 0.0, 1.0), "axis": (0.0, 1.0, 0.0)}
        held.append(scene.attach(body, before, kind="hinge", **place))
        before = body
    sim = wc.Simulation(scene)
    for hinge in held:
        sim.set_motor(hinge, 0.0, 50.0)
    for _ in sim.frames(20):
        pass
    weight = G * 0.2 * 0.04 * 0.04 * 1000.0
    arms = np.array([0.11 + 0.33 + 0.55, 0.11 + 0.33, 0.11])
    found = [-sim.motor_force(hinge) for hinge in held]
    np.testing.assert_allclose(found, weight * arms, rtol=2e-3)  # it sinks by 0.06 mm first
    assert np.abs(sim.velocities()).max() < 1e-4
    speeds = 1.0, -2.0, 3.0
    for hinge, speed in zip(held, speeds, strict=True):
        sim.set_motor(hinge, speed, 50.0)
    for _ in sim.frames(20):
        pass
    found = np.diff([0.0, *(spin(sim, body, 1) for body in range(3))])
    np.testing.assert_allclose(found, speeds, rtol=5e-3)


def test_motors_about_any_axes_stay_calm_and_within_their_limits(rng):
    """A motor would turn a thin link very fast if it were not for the others."""
    scene, link = wc.Scene(friction=0.4), wc.box((0.2, 0.05, 0.05), (3, 1, 1))
    scene.add_plane((0.0, 0.0, 1.0))
    held, before = [], None
    for k in range(4):
        weighs = wc.Rigid(rng.uniform(300.0, 3000.0))
        body = scene.add_body(link, weighs, (0.1 + 0.22 * k, 0.0, 0.3))
        place = {"at": (0.22 * k - 0.01, 0.0, 0.3), "axis": rng.normal(size=3)}
        held.append(scene.attach(body, before, kind="hinge", **place))
        before = body
    sim, limits = wc.Simulation(scene), np.array([50.0, 0.2, 50.0, 2.0])
    for hinge, limit in zip(held, limits, strict=True):
        sim.set_motor(hinge, rng.normal(), limit)
    for _ in sim.frames(40):
        assert np.abs(sim.velocities()).max() < 10.0  # links of 0.2 m at some 1/s, and their fall
        found = np.array([sim.motor_force(hinge) for hinge in held])
        assert (np.abs(found) < 1.001 * limits).all()


def test_what_has_no_axis_takes_no_motor():
    scene = wc.Scene()
    scene.add_body(BOX, SOLID)
    weld = scene.attach(0, label="grip")
    sim = wc.Simulation(scene)
    with pytest.raises(ValueError, match="attachment 'grip' is a weld: a motor drives a hinge"):
        sim.set_motor(weld, 1.0, 1.0)
    sim, held = lift(1.0, frames=0)
    with pytest.raises(ValueError, match="limit"):
        sim.set_motor(held, 1.0, -1.0)
    with pytest.raises(ValueError, match="velocity"):
        sim.set_motor(held, np.nan, 1.0)
