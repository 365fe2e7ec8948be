"""Bodies too large for an inverse take explicit steps beside implicit and rigid ones."""

import numpy as np
import pytest

import warp_contact as wc
from warp_contact.frame import implicit_shapes
from warp_contact.frame.step_bounds import SAFETY

LARGEST = 30  # vertices of a body with an inverse here: 27 have one, 64 none
FOAM = wc.NeoHookean(5e4, 0.3, 1000.0, 1e-3)
UNDAMPED = wc.NeoHookean(5e4, 0.3, 1000.0)
FIRM = wc.NeoHookean(1e9, 0.3, 1000.0, 1e-3)
TOOL = wc.Rigid(2000.0)
TILT = np.array([0.1, 0.2, 0.05, 1.0]) / np.linalg.norm([0.1, 0.2, 0.05, 1.0])
NONE = (0.0, 0.0, 0.0)


@pytest.fixture(autouse=True)
def limit(monkeypatch):
    monkeypatch.setattr(implicit_shapes, "LARGEST", LARGEST)


def run(sim: wc.Simulation, n: int) -> wc.Simulation:
    for _ in sim.frames(n):
        pass
    return sim


def tower() -> wc.Scene:
    """A rigid box and an implicit block on a lumped block."""
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    scene.add_body(wc.box(0.1, 3), FOAM, (0.0, 0.0, 0.0501), label="foam")
    scene.add_body(wc.box(0.06, 2), TOOL, (0.005, 0.0, 0.1302), label="tool")
    scene.add_body(wc.box(0.05, 2), FIRM, (0.0, 0.005, 0.1853), label="firm")
    return scene


def test_a_summary_says_which_bodies_take_explicit_steps_and_why():
    said = wc.Simulation(tower()).summary()
    assert "implicit steps: body 'tool' is rigid; body 'foam' takes explicit ones" in said
    assert f"more than {LARGEST} vertices" in said


def test_bodies_rest_on_a_lumped_one_with_their_weight():
    sim = run(wc.Simulation(tower()), 40)
    names, masses = ("foam", "tool", "firm"), sim.model.mass.numpy().astype(float)
    mass = np.bincount(sim.model.vert_body.numpy(), masses)

    def momenta():
        v = masses * sim.velocities()[:, 2].astype(float)
        return np.bincount(sim.model.vert_body.numpy(), v)

    before, pushed, frames = momenta(), np.zeros(3), 20
    for _ in sim.frames(frames):
        now = sim.measure()
        forces = {frozenset(pair): force for pair, force in now.forces.items()}
        below = ("plane0", *names)
        pushed += [forces[frozenset(pair)] / sim.fps for pair in zip(below, names, strict=False)]
    assert now.overlap <= 1e-4 * 0.025
    # What a contact carries is the weight above it and what is above it gains.
    above = np.cumsum((mass * 9.81 * frames / sim.fps + momenta() - before)[::-1])[::-1]
    np.testing.assert_allclose(pushed, above, rtol=1e-3)


def colliding(one, other, **settings) -> wc.Simulation:
    scene = wc.Scene(gravity=NONE, friction=0.3)
    scene.add_body(wc.box(0.1, 3), one, NONE, velocity=(0.0, 0.0, 0.5))
    place, down = (0.03, 0.02, 0.125), (0.0, 0.0, -0.5)
    scene.add_body(wc.box(0.1, 2), other, place, TILT, velocity=down)
    return wc.Simulation(scene, integrator="implicit", **settings)


@pytest.mark.parametrize("other", [TOOL, FIRM, FOAM])
@pytest.mark.parametrize("one", [FOAM, UNDAMPED])
def test_a_collision_keeps_momenta_and_gains_no_energy(one, other):
    sim = colliding(one, other)
    start, deepest = sim.measure(), 0.0
    for _ in sim.frames(20):
        now = sim.measure()
        assert now.energy <= 1.0005 * start.energy
        deepest = max(deepest, now.overlap)
    scale = 0.5 * sim.model.mass.numpy().sum()
    assert now.forces == {} and deepest <= 1e-4 * 0.1  # they have parted
    assert np.abs(now.momentum - start.momentum).max() <= 1e-6 * scale
    away = now.angular_momentum - start.angular_momentum
    assert np.abs(away).max() <= 1e-5 * 0.1 * scale


def vibrating(material, beside, rate=8.0, gravity=(0.0, 0.0, -9.81), **settings):
    """A lumped bar that spins and vibrates, with a body far away."""
    scene = wc.Scene(gravity)
    bar = wc.box((0.1, 0.06, 0.03), (5, 3, 2))
    arm = bar.vertices - bar.vertices.mean(axis=0)
    v = np.cross([3.0, -4.0, 2.0], arm) + rate * arm * (1.0, -1.0, 0.0)
    scene.add_body(bar, material, velocity=v)
    scene.add_body(wc.box(0.1, 2), beside, (2.0, 0.0, 0.0))
    return wc.Simulation(scene, **settings)


@pytest.mark.parametrize("material", [FOAM, UNDAMPED])
def test_a_lumped_body_moves_as_in_an_explicit_scene(material):
    explicit = vibrating(material, UNDAMPED, integrator="explicit", substeps=24)
    mixed = vibrating(material, TOOL, substeps=24)
    for _ in zip(explicit.frames(12), mixed.frames(12), strict=True):
        np.testing.assert_array_equal(mixed.positions(0), explicit.positions(0))
        np.testing.assert_array_equal(mixed.velocities(0), explicit.velocities(0))


def test_too_many_steps_are_blamed_on_the_lumped_body():
    with pytest.raises(wc.SimulationError, match="body 'foam' vibrates at"):
        wc.Simulation(tower(), max_substeps=10).step_frame()


def test_the_damping_of_implicit_bodies_does_not_act_on_lumped_ones():
    runs = []
    for damping in (0.0, 1e-3, 10.0):
        sim = vibrating(FOAM, wc.NeoHookean(1e9, 0.3, 1000.0, damping), integrator="implicit")
        runs.append(run(sim, 8).positions(0))
    np.testing.assert_array_equal(runs[1], runs[0])
    np.testing.assert_array_equal(runs[2], runs[0])


def test_free_vibration_gains_no_energy_where_the_number_of_steps_follows_it():
    sim = vibrating(wc.NeoHookean(2e4, 0.3, 1000.0), TOOL, 20.0, NONE, fps=240)
    start, taken = sim.measure().energy, set()
    for frame in sim.frames(360):
        taken.add(sim.substeps)
        assert frame % 6 or sim.measure().energy <= 1.0002 * start
    # Each change of the step takes some: 1.5 %, and 6.6 % if it were changed at once.
    assert len(taken) > 1 and sim.measure().energy >= 0.97 * start


def test_steps_are_those_of_the_lumped_body_from_a_short_list():
    sim = vibrating(FOAM, FIRM, integrator="implicit")
    omega = sim._stepper.spectrum.rates(sim.state.x)[0, 0]
    sim.step_frame()
    alone = vibrating(FOAM, UNDAMPED, integrator="explicit")
    alone.step_frame()
    assert sim.substeps >= omega / (2.0 * SAFETY) / 60.0
    assert alone.substeps <= sim.substeps <= 1.5 * alone.substeps


def test_two_runs_have_the_same_bits_and_a_reset_repeats_them():
    a, b = (run(colliding(FOAM, TOOL), 12) for _ in range(2))
    np.testing.assert_array_equal(a.positions(), b.positions())
    a.reset()
    np.testing.assert_array_equal(run(a, 12).positions(), b.positions())


def test_a_run_that_is_loaded_goes_on_with_the_same_bits(tmp_path):
    whole, half, again = (colliding(FOAM, FIRM) for _ in range(3))
    run(half, 7).save(tmp_path / "half.npz")
    again.load(tmp_path / "half.npz")
    run(whole, 12), run(again, 5)
    np.testing.assert_array_equal(again.positions(), whole.positions())
    np.testing.assert_array_equal(again.velocities(), whole.velocities())


def test_forces_and_torques_act_on_a_lumped_body():
    scene = wc.Scene(gravity=NONE)
    scene.add_body(wc.box(0.1, 3), wc.NeoHookean(1e5, 0.3, 1000.0, 1e-3), label="foam")
    scene.add_body(wc.box(0.1, 2), TOOL, (1.0, 0.0, 0.0), label="tool")
    sim = wc.Simulation(scene)
    mass, x = sim.model.mass.numpy()[:64].astype(float), sim.positions("foam").astype(float)
    moment = mass @ (x[:, 0] ** 2 + x[:, 1] ** 2)
    speed, spin, place = 0.0, 0.0, 0.0
    for push in (0.3, -0.1, 0.5, 0.2):
        sim.apply("foam", (0.0, push, 0.0), torque=(0.0, 0.0, 1e-3 * push))
        sim.step_frame()
        place += (speed + 0.5 * push / mass.sum() / sim.fps) / sim.fps
        speed += push / mass.sum() / sim.fps
        spin += 1e-3 * push / moment / sim.fps
    v = sim.velocities("foam").astype(float)
    np.testing.assert_allclose(mass @ v / mass.sum(), [0.0, speed, 0.0], atol=1e-6)
    np.testing.assert_allclose(
        mass @ (sim.positions("foam") - x) / mass.sum(), [0, place, 0], atol=1e-6
    )
    turning = mass @ np.cross(x, v - v.mean(axis=0))[:, 2]
    assert turning == pytest.approx(spin * moment, rel=1e-3)
    assert np.abs(sim.velocities("tool")).max() == 0.0


def test_a_force_that_throws_a_lumped_body_asks_for_short_steps():
    sim = vibrating(FOAM, TOOL, gravity=NONE)
    speed, mass = 40.0, 0.18  # [m/s] after a frame, [kg]
    sim.apply(0, (0.0, speed * mass * sim.fps, 0.0))
    sim.step_frame()
    assert speed / sim.fps / sim.substeps <= 0.25 * sim.model.body_thickness.numpy()[0]


def test_velocities_that_are_set_are_read_back():
    sim = run(vibrating(FOAM, TOOL), 3)
    for body in (0, 1):
        wanted = sim.velocities(body) + np.float32(0.5)
        sim.set_velocity(body, wanted)
        # Half a step is added and taken off again.
        np.testing.assert_allclose(sim.velocities(body), wanted, atol=2e-6)


def struck(scene, world: int, material) -> None:
    """A lumped block under a rigid box."""
    scene.add_body(wc.box(0.1, 3), material, (0.0, 0.0, 0.0502), world=world)
    place, down = (0.02, 0.01, 0.16), (0.0, 0.0, -1.0)
    scene.add_body(wc.box(0.08, 2), TOOL, place, TILT, velocity=down, world=world)


def loose(scene, world: int, material) -> None:
    """An implicit block, and an undamped lumped one that shakes."""
    scene.add_body(wc.box(0.08, 2), material, (0.0, 0.0, 0.0402), world=world)
    block = wc.box(0.05, 3)
    shake = 5.0 * block.vertices * (1.0, -1.0, 0.0)
    scene.add_body(block, UNDAMPED, (0.2, 0.0, 0.3), velocity=shake, world=world)


@pytest.mark.parametrize("sleeping", [False, True])
def test_a_world_does_not_feel_lumped_bodies_in_others(sleeping):
    runs = []
    for worlds in ((3,), (1, 3), (1,)):
        scene = wc.Scene(friction=0.3)
        scene.add_plane((0.0, 0.0, 1.0))
        if 1 in worlds:
            struck(scene, 1, wc.NeoHookean(2e5, 0.3, 1000.0, 2e-3))
        if 3 in worlds:
            loose(scene, 3, FIRM)
        sim = wc.Simulation(scene, integrator="implicit", sleeping=sleeping)
        runs.append(run(sim, 10).positions())
    np.testing.assert_array_equal(runs[1], np.concatenate([runs[2], runs[0]]))


def test_a_crushed_implicit_body_is_no_reason_to_look_at_the_rates_more_often():
    sim = vibrating(FOAM, FIRM, integrator="implicit")
    for body, looked in ((1, False), (0, True)):
        sim.set_positions(body, sim.positions(body) * (1.0, 1.0, 0.1))
        sim._stepper.spectrum.rates(sim.state.x)
        assert sim._stepper.spectrum.flat[0] == looked


def test_what_rests_sleeps_until_it_is_pushed():
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    strong = wc.NeoHookean(5e4, 0.3, 1000.0, 2e-2)
    scene.add_body(wc.box(0.1, 3), strong, (0.0, 0.0, 0.0501), label="foam")
    scene.add_body(wc.box(0.06, 2), TOOL, (0.005, 0.0, 0.1302), label="tool")
    sim = run(wc.Simulation(scene, sleeping=True), 75)
    still, weight = sim.positions(), 9.81 * sim.model.mass.numpy().sum()
    # The force of the last frame awake; STILL lets a little motion be left.
    assert sim.measure().forces["foam", "plane0"] == pytest.approx(weight, rel=2e-3)
    assert not sim._stepper.work.awake.bodies.numpy().any()
    np.testing.assert_array_equal(run(sim, 5).positions(), still)
    sim.apply("foam", (0.0, 0.0, 60.0))
    assert (run(sim, 2).positions()[:, 2] - still[:, 2]).min() > 1e-4


def test_a_lumped_body_that_is_crushed_recovers():
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    scene.add_body(wc.box(0.1, 3), FOAM, (0.0, 0.0, 0.0501))
    heavy = wc.Rigid(1e4)
    scene.add_body(wc.box(0.1, 2), heavy, (0.01, 0.0, 0.152), velocity=(0.0, 0.0, -3.0))
    sim = wc.Simulation(scene)
    start, flattest, most = sim.measure().energy, 1.0, 0
    for _ in sim.frames(12):
        now = sim.measure()
        flattest, most = min(flattest, now.volume_ratio), max(most, sim.substeps)
        assert now.energy <= 1.001 * start
    assert flattest < 0.4 and most > 48
    assert now.inverted == 0 and now.volume_ratio > 0.7


def test_auto_takes_lumped_bodies_into_account():
    def chosen(soft: float, stiff: float) -> str:
        scene = wc.Scene()
        scene.add_body(wc.box(0.1, 3), wc.NeoHookean(soft, 0.3, 1000.0), (1.0, 0.0, 0.0))
        scene.add_body(wc.box(0.1, 2), wc.NeoHookean(stiff, 0.3, 1000.0))
        return wc.Simulation(scene, integrator="auto").summary()

    assert "takes explicit ones" in chosen(1e4, 1e9)
    assert "explicit steps: " in chosen(1e9, 1e4)
    assert "explicit steps: " in chosen(1e9, 2e9)


def test_a_rigid_tool_rests_on_a_large_soft_body(monkeypatch):
    monkeypatch.undo()
    scene = wc.Scene(friction=0.3)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    scene.add_body(wc.box(0.2, 10), wc.NeoHookean(5e4, 0.3, 1000.0, 1e-2), (0.0, 0.0, 0.1001))
    scene.add_body(wc.box(0.08, 2), TOOL, (0.01, 0.0, 0.2402), label="tool")
    sim = wc.Simulation(scene)
    assert "1331" not in sim.summary() and "more than 800" in sim.summary()
    run(sim, 40)
    now = sim.measure()
    weight = 9.81 * float(sim.model.mass.numpy()[1331:].sum())
    assert now.forces["body0", "tool"] == pytest.approx(weight, rel=2e-2)
    assert now.overlap <= 1e-4 * 0.02
