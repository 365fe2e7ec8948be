"""Gravity and friction that change between frames: closed forms, checkpoints, reset, sleeping."""

import numpy as np
import pytest

import warp_contact as wc

EDGE, G, FPS = 0.1, 9.81, 120
RUBBER = wc.NeoHookean(2e5, 0.3, 1000.0, 4e-3)
DOWN, ASIDE = (0.0, 0.0, -G), (G, 0.0, 0.0)
WAYS = {"explicit": (RUBBER, {}), "implicit": (RUBBER, {"integrator": "implicit"})}
WAYS["rigid"] = (wc.Rigid(1000.0), {})
WAYS["penalty"] = (RUBBER, {"response": wc.Penalty(2e4, 5.0)})


def block(way: str, gravity=DOWN, friction=0.2, height=0.5 * EDGE, floor=True, **settings):
    """A block on a floor, or high above one."""
    material, of_way = WAYS[way]
    scene = wc.Scene(gravity, friction)
    if floor:
        scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(wc.box(EDGE, 2), material, (0.0, 0.0, height), label="block")
    return wc.Simulation(scene, fps=FPS, **{**of_way, **settings})


def run(sim: wc.Simulation, frames: int) -> wc.Simulation:
    for _ in sim.frames(frames):
        pass
    return sim


@pytest.mark.parametrize("way", WAYS)
def test_a_body_in_free_flight_follows_gravity_at_once(way):
    sim = block(way, height=2.0, floor=False)
    place, speed = np.array([0.0, 0.0, 2.0]), np.zeros(3)
    for gravity in (DOWN, ASIDE, (0.0, 2.0, 5.0), (0.0, 0.0, 0.0)):
        sim.set_gravity(gravity)
        np.testing.assert_allclose(sim.velocities().mean(axis=0), speed, atol=2e-5)  # rounding
        for _ in sim.frames(6):  # symplectic Euler is exact in free flight
            t = 1.0 / FPS
            place = place + t * speed + 0.5 * t * t * np.array(gravity)
            speed = speed + t * np.array(gravity)
        # Rounding of positions of 2 m, step after step.
        np.testing.assert_allclose(sim.positions().mean(axis=0), place, atol=2e-5)
        np.testing.assert_allclose(sim.velocities().mean(axis=0), speed, atol=1e-4 * G)


def test_a_held_body_swings_about_its_new_sag_with_the_energy_that_it_had():
    def hanging(gravity):
        scene = wc.Scene(gravity)
        mesh = wc.box((0.1, 0.1, 0.2), (2, 2, 4))
        top = mesh.vertices[:, 2] > 0.099
        scene.add_body(mesh, wc.NeoHookean(1e5, 0.3, 1000.0, 2e-2), fixed=top)
        return wc.Simulation(scene, fps=FPS, integrator="implicit")

    changed, other = run(hanging((0.0, 0.0, 0.0)), 10), run(hanging(DOWN), 90)
    before = changed.velocities()
    changed.set_gravity(DOWN)
    np.testing.assert_allclose(changed.velocities(), before, atol=1e-6)
    run(changed, 90)
    sag = np.abs(other.positions() - hanging(DOWN).positions()).max()
    assert sag > 1e-3
    assert np.abs(changed.positions() - other.positions()).max() < 1e-3 * sag


@pytest.mark.parametrize("way", WAYS)
def test_friction_that_changes_lets_a_block_go_and_stops_it(way):
    angle = 0.35  # its tangent is 0.365
    gravity = G * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    sim = run(block(way, gravity, 0.9), 30)
    # 3 % of free fall: the block first sinks into its weight, and rocks while it slides.
    assert abs(sim.velocities()[:, 0].mean()) < 0.03 * G * 30 / FPS
    sim.set_friction("block", 0.2)  # with 0 of the floor the mean is 0.1
    sim.set_friction("plane0", 0.0)
    v = run(sim, 60).velocities()[:, 0].mean()
    wanted = (np.sin(angle) - 0.1 * np.cos(angle)) * G * 60 / FPS
    assert v == pytest.approx(wanted, abs=0.03 * G * 60 / FPS)
    sim.set_friction("block", 0.6)
    sim.set_friction("plane0", 0.8)  # and now 0.7
    slower = (np.sin(angle) - 0.7 * np.cos(angle)) * G * 20 / FPS
    assert run(sim, 20).velocities()[:, 0].mean() - v == pytest.approx(
        slower, abs=0.03 * G * 60 / FPS
    )


@pytest.mark.parametrize("way", ["explicit", "rigid"])
def test_a_checkpoint_and_a_reset_know_what_they_were(way, tmp_path):
    def episode(sim):
        seen = []
        for frame in sim.frames(12):
            if frame == 4:
                sim.set_gravity(ASIDE)
                sim.set_friction(0, 0.05)
            if frame == 8:
                sim.save(tmp_path / "run.npz")
            seen.append(sim.positions())
        return seen

    sim = block(way)
    first = episode(sim)
    other = block(way)
    other.load(tmp_path / "run.npz")
    np.testing.assert_array_equal(run(other, 4).positions(), first[-1])
    sim.reset()
    np.testing.assert_array_equal(np.array(episode(sim)), np.array(first))


@pytest.mark.parametrize("change", ["gravity", "friction", "plane"])
def test_what_sleeps_wakes(change):
    sim = run(block("explicit", (4.0, 0.0, -G), 0.7, sleeping=True), 90)
    assert not sim._stepper.sleeping.awake.bodies.numpy().any()
    if change == "gravity":
        sim.set_gravity((9.0, 0.0, -3.0))
    else:
        sim.set_friction("plane0" if change == "plane" else "block", 0.0)
    x = sim.positions()[:, 0].mean()
    assert run(sim, 30).positions()[:, 0].mean() > x + 0.015


def test_what_floats_does_not_sleep_and_what_comes_to_rest_does():
    sim = block("explicit", (0.0, 0.0, 0.0), sleeping=True)
    sim.set_velocity("block", (0.0, 0.0, 1e-5))
    assert run(sim, 80)._stepper.sleeping.awake.bodies.numpy().all()
    sim.set_gravity(DOWN)
    assert not run(sim, 150)._stepper.sleeping.awake.bodies.numpy().any()
    sim.set_gravity((0.0, 0.0, 0.0))
    assert run(sim, 80)._stepper.sleeping.awake.bodies.numpy().all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: s.set_gravity((0.0, 1.0)), r"gravity \(0.0, 1.0\): give finite numbers"),
        (lambda s: s.set_gravity((0.0, 1.0, np.inf)), "gravity .*give finite numbers"),
        (lambda s: s.set_friction("block", -1.0), "friction -1.0"),
        (lambda s: s.set_friction("block", None), "friction None"),
        (lambda s: s.set_friction("plane1", 0.1), "there is no 'plane1': the scene has 1 planes"),
        (lambda s: s.set_friction("plank", 0.1), "there is no body 'plank'"),
        (lambda s: s.set_friction(7, 0.1), "there is no body 7"),
    ],
)
def test_what_makes_no_sense_is_refused_and_changes_nothing(call, message):
    sim = block("explicit")
    before = sim._surroundings.values()
    with pytest.raises(ValueError, match=message):
        call(sim)
    for name, value in sim._surroundings.values().items():
        np.testing.assert_array_equal(value, before[name])
