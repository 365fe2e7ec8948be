"""Positions and velocities belong to the same time, whatever the steps and whoever set them."""

import numpy as np
import pytest

from warp_contact import NeoHookean, Penalty, Rigid, Scene, Simulation, box
from warp_contact.frame import between

G = 9.81
SOFT = NeoHookean(2e4, 0.3, 1000.0, 2e-3)
SOFTER = NeoHookean(1e3, 0.3, 1000.0, 2e-3)  # one step in a thirtieth of a second is stable
# Free flight is exact but for rounding: of some hundred steps in float32, in positions of 0.1 m
# and velocities of 1 m/s.
ROUNDING = 1e-5


def thrown(v=(1.0, 0.0, 2.0), gravity=(0.0, 0.0, -G), **settings) -> Simulation:
    scene = Scene(gravity=gravity)
    scene.add_body(box(0.1, 1), SOFTER, velocity=v)
    return Simulation(scene, **settings)


def run(sim: Simulation, frames: int) -> Simulation:
    for _ in sim.frames(frames):
        pass
    return sim


def flown(sim: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Mean way from the start [m] and mean velocity [m/s]."""
    way = sim.positions().astype(np.float64) - sim.scene.bodies[0].x
    return way.mean(axis=0), sim.velocities().astype(np.float64).mean(axis=0)


@pytest.mark.parametrize("fps, substeps", [(30, 2), (60, 1), (60, None), (240, 3), (1000, 1)])
def test_a_throw_is_a_parabola_from_its_first_frame_on(fps, substeps, rng):
    v = rng.uniform(-1.0, 1.0, 3)
    sim = thrown(v, fps=fps, substeps=substeps)
    weight = np.array([0.0, 0.0, -G])
    for _ in sim.frames(8):
        t = sim.time
        way, speed = flown(sim)
        np.testing.assert_allclose(way, v * t + 0.5 * weight * t * t, atol=ROUNDING * max(t, 0.05))
        np.testing.assert_allclose(speed, v + weight * t, atol=ROUNDING)
        now, u = sim.measure(), v + weight * t
        np.testing.assert_allclose(now.momentum, u, atol=ROUNDING)  # 1 kg
        assert now.kinetic == pytest.approx(0.5 * u @ u, abs=2 * ROUNDING)


def test_steps_of_other_lengths_go_on_from_there():
    sim = thrown(fps=100, substeps=1)
    for n in (3, 1, 7, 2):
        sim._stepper._step_count.wanted = sim._stepper.wanted = n
        sim.step_frame()
    t = sim.time
    way, speed = flown(sim)
    np.testing.assert_allclose(way, [t, 0.0, 2.0 * t - 0.5 * G * t * t], atol=ROUNDING)
    np.testing.assert_allclose(speed, [1.0, 0.0, 2.0 - G * t], atol=ROUNDING)


def test_a_throw_from_a_velocity_set_on_the_way_is_one_from_there():
    sim = run(thrown(fps=60, substeps=1), 3)
    start, _ = flown(sim)
    sim.set_velocity(0, (0.0, 1.0, 3.0))
    np.testing.assert_allclose(flown(sim)[1], [0.0, 1.0, 3.0], atol=ROUNDING)
    t = 4 / 60
    way, speed = flown(run(sim, 4))
    np.testing.assert_allclose(way - start, [0.0, t, 3.0 * t - 0.5 * G * t * t], atol=ROUNDING)
    np.testing.assert_allclose(speed, [0.0, 1.0, 3.0 - G * t], atol=ROUNDING)


def test_a_jump_keeps_the_velocities_of_its_time():
    sim = run(thrown(fps=60, substeps=1), 3)
    before, speed = flown(sim)
    sim.set_positions(0, sim.positions() + np.float32([0.0, 0.5, 0.0]))
    np.testing.assert_allclose(flown(sim)[1], speed, atol=ROUNDING)
    t = 4 / 60
    way, _ = flown(run(sim, 4))
    fallen = speed * t - [0.0, 0.0, 0.5 * G * t * t] + [0.0, 0.5, 0.0]
    np.testing.assert_allclose(way - before, fallen, atol=ROUNDING)


def test_a_checkpoint_tells_the_same_velocities(tmp_path):
    sim = run(thrown(fps=60, substeps=1), 3)
    sim.save(tmp_path / "run.npz")
    other = thrown(fps=60, substeps=1)
    other.load(tmp_path / "run.npz")
    np.testing.assert_array_equal(other.velocities(), sim.velocities())


def test_a_mode_of_vibration_has_the_phase_of_its_closed_form():
    # The longest mode of a bar with held ends, excited by its own shape: cosine in time.
    mesh = box((1.0, 0.1, 0.1), (20, 1, 1))
    x = mesh.vertices
    scene = Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(mesh, NeoHookean(1e4, 0.0, 1000.0), fixed=np.abs(x[:, 0]) > 0.499)
    sim = Simulation(scene, fps=100)
    shape = np.zeros_like(x)
    shape[:, 0] = 1e-3 * np.cos(np.pi * x[:, 0])
    sim.set_positions(0, x + shape)
    weight = shape[:, 0] / (shape[:, 0] ** 2).sum()
    found = np.array(
        [
            (weight @ (sim.positions() - x)[:, 0], weight @ sim.velocities()[:, 0])
            for _ in sim.frames(60)
        ]
    )
    # Amplitude and phase of velocities against those of positions: v = dx/dt, by differences over
    # two frames, whose error is (omega / fps)^2 / 6, 1.6 %, of the largest speed.
    slope = 0.5 * sim.fps * (found[2:, 0] - found[:-2, 0])
    assert np.abs(found[:, 1]).max() > 5.0  # it moves
    np.testing.assert_allclose(found[1:-1, 1], slope, atol=0.02 * np.abs(slope).max())


@pytest.mark.parametrize("response", [None, Penalty(2e4)], ids=["default", "penalty"])
def test_what_rests_does_not_move(response, tmp_path):
    def stacked() -> Simulation:
        scene = Scene(friction=0.5)
        scene.add_plane((0.0, 0.0, 1.0))
        for k in range(3):
            material = NeoHookean(1e5, 0.3, 1000.0, 8e-3)
            scene.add_body(box(0.1, 2), material, (0.0, 0.0, 0.05 + 0.1001 * k))
        return Simulation(scene, response)

    sim = run(stacked(), 120)
    # The half step that is missing is 2 to 6 mm/s: contacts have to take it.
    half = 0.5 * G / (sim.fps * sim.substeps)
    assert half > 2e-3
    moved = np.abs(sim.positions() - run(sim, 1).positions()).max() * sim.fps
    # Penalty forces at rims that lie flush come and go: the quietest of some frames.
    quietest = min((run(sim, 1).velocities() for _ in range(6)), key=lambda v: np.abs(v).max())
    np.testing.assert_allclose(quietest, 0.0, atol=0.1 * half + 2.0 * moved)
    sim.save(tmp_path / "run.npz")
    other = stacked()
    other.load(tmp_path / "run.npz")
    np.testing.assert_array_equal(other.velocities(), sim.velocities())


@pytest.mark.parametrize("material", [NeoHookean(1e5, 0.3, 1000.0, 2e-3), Rigid(1000.0)], ids=str)
def test_what_rests_reads_no_velocity_in_steps_that_fall_less_than_its_gap(material):
    scene = Scene()
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(box(0.1, 2), material, (0.0, 0.0, 0.05001))
    sim = run(Simulation(scene, fps=960, integrator="implicit"), 500)
    assert sim.substeps == 1 and 0.5 * G / sim.fps > 5e-3  # half a step of free fall
    # Positions of 0.1 m in float32 tell no slower motion in a step than 7e-6 m/s.
    np.testing.assert_allclose(sim.velocities(), 0.0, atol=5e-5)


def test_reading_changes_nothing():
    def dropped() -> Simulation:
        scene = Scene(friction=0.4)
        scene.add_plane((0.0, 0.0, 1.0))
        for k in range(3):
            scene.add_body(box(0.1, 2), SOFT, (0.02 * k, 0.01 * k, 0.06 + 0.12 * k))
        return Simulation(scene)

    read, left = dropped(), dropped()
    for _ in read.frames(25):
        read.velocities()
        fields, forces = read.contact_fields(), read.measure().forces
        assert read.measure().forces == forces
        for name, values in read.contact_fields().items():
            np.testing.assert_array_equal(values, fields[name])
        left.step_frame()
    np.testing.assert_array_equal(read.positions(), left.positions())
    np.testing.assert_array_equal(read.velocities(), left.velocities())
    assert read.measure().n_contacts > 0


def test_far_from_the_origin_blocks_come_to_rest_where_they_do_at_the_origin():
    # Not tumbling ones: rounding alone decides on which side these end, anywhere.
    ends, weight = [], 9.81 * 500.0 * (0.5**3 + 0.3**3)
    for far in (0.0, 600.0):  # 3000 edges: a little less than what is refused
        scene, soft = Scene(friction=0.4), NeoHookean(1e5, 0.3, 500.0, 8e-3)
        scene.add_plane((0.0, 0.0, 1.0), far)
        scene.add_body(box(0.5, 3), soft, (0.0, 0.0, far + 0.3))
        turn = 0.0, 0.0, np.sin(np.radians(10.0)), np.cos(np.radians(10.0))
        scene.add_body(box(0.3, 2), soft, (0.05, 0.03, far + 0.75), turn)
        sim = run(Simulation(scene), 150)
        ends.append([sim.positions(k).mean(axis=0) - [0.0, 0.0, far] for k in (0, 1)])
        held = [sim.measure().forces["body0", "plane0"] for _ in sim.frames(30)]
        assert np.mean(held) == pytest.approx(weight, rel=0.01)
    np.testing.assert_allclose(ends[1], ends[0], atol=0.01 * 0.5)  # 1 % of a size


def test_a_reading_that_is_interrupted_changes_nothing(monkeypatch):
    def falling() -> Simulation:
        scene = Scene(friction=0.4)
        scene.add_plane((0.0, 0.0, 1.0))
        for k in range(2):
            scene.add_body(box(0.1, 2), SOFT, (0.02 * k, 0.0, 0.05 + 0.11 * k))
        return run(Simulation(scene), 8)

    read, left = falling(), falling()
    pressure, look = read.contact_fields()["pressure"], between.velocities_now

    def interrupted(*given):
        look(*given)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(between, "velocities_now", interrupted)
        read.velocities()
    np.testing.assert_array_equal(read.contact_fields()["pressure"], pressure)
    assert pressure.any()
    np.testing.assert_array_equal(run(read, 4).positions(), run(left, 4).positions())
