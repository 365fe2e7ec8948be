"""Rigid bodies against closed forms, an ODE solver and stiff bodies; poses, forces, torques."""

import numpy as np
import pytest

import warp_contact as wc
from warp_contact.scene.scene import rotation_matrix

G = 9.81


SOLID = wc.Rigid(1000.0)
DIE = wc.box((0.1, 0.06, 0.03), 2)


def loaded(mesh, shift, rotation=(0.0, 0.0, 0.0, 1.0)) -> wc.Rigid:
    """The solid of a mesh, with its mass moved and turned in it."""
    solid, turn = SOLID.solid(mesh.vertices, mesh.tets), rotation_matrix(rotation)
    inertia = turn @ solid.inertia @ turn.T
    return wc.Rigid(mass=solid.mass, centre=solid.centre + shift, inertia=inertia)


LOADED = loaded(DIE, (0.01, -0.02, 0.005), (0.4, -0.3, 0.2, 0.8))


def on_a_slope(degrees: float, mesh, friction: float, frames: int, material=SOLID):
    """Simulation and path along x of a rigid body that starts at rest on a slope."""
    angle = np.radians(degrees)
    scene = wc.Scene(gravity=(G * np.sin(angle), 0.0, -G * np.cos(angle)), friction=friction)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    height = -mesh.vertices[:, 2].min() + 1e-5
    scene.add_body(mesh, material, (0.0, 0.0, height))
    sim = wc.Simulation(scene)
    start = sim.pose(0)[0][0]
    return sim, np.array([sim.pose(0)[0][0] - start for _ in sim.frames(frames)])


def test_it_slides_down_a_slope_as_coulomb_says():
    _, path = on_a_slope(20.0, wc.box(0.1, 2), 0.2, 60)
    rate = G * (np.sin(np.radians(20.0)) - 0.2 * np.cos(np.radians(20.0)))
    t = np.arange(1, 61) / 60
    # It falls by 1e-5 m first.
    np.testing.assert_allclose(path, 0.5 * rate * t * t, atol=2e-4)


def test_it_stays_where_friction_holds_it():
    _, path = on_a_slope(20.0, wc.box(0.1, 2), 0.5, 60)
    assert np.abs(path).max() < 5e-5  # it falls by 1e-5 m first


@pytest.mark.parametrize(
    ("degrees", "height", "falls"),
    [(24.0, 0.05, False), (29.0, 0.05, True), (29.0, 0.03, False), (24.0, 0.07, True)],
)
def test_it_topples_where_its_weight_leaves_its_base(degrees, height, falls):
    box = wc.box((0.05, 0.05, 0.1), 2)  # limits: atan 1/2 = 26.6, 39.8 and 19.7 degrees
    material = SOLID if height == 0.05 else loaded(box, (0.0, 0.0, height - 0.05))
    sim, _ = on_a_slope(degrees, box, 1.5, 90, material)
    turned = 2.0 * np.arccos(min(1.0, sim.pose(0)[1][3]))
    assert (turned > 0.5) == falls
    assert falls or turned < 1e-3


@pytest.mark.parametrize("ratio", [2 / 5, 2 / 3])
def test_a_ball_and_a_shell_roll_down_a_slope(ratio):
    ball, angle = wc.sphere(0.05, 3000), np.radians(25.0)
    shell = wc.Rigid(mass=0.3, centre=(0, 0, 0), inertia=ratio * 0.3 * 0.05**2 * np.eye(3))
    sim, path = on_a_slope(25.0, ball, 0.9, 20, SOLID if ratio < 0.5 else shell)
    t = np.arange(1, 21) / 60
    reached = path / (0.5 * G * np.sin(angle) / (1.0 + ratio) * t * t)
    # It is no ball: each of its facets takes energy, more the faster it rolls over them.
    loss, slow = np.polyfit(t[5:], reached[5:], 1)
    assert loss < 0.0 and reached[-1] > 0.9 and abs(slow - 1.0) < 0.03
    v = sim.velocities(0)
    spin = np.linalg.norm(v - v.mean(axis=0), axis=1).max()
    assert abs(spin / np.linalg.norm(v.mean(axis=0)) - 1.0) < 0.05  # it does not slide


def euler(inertia: np.ndarray, w: np.ndarray, t: float, steps: int) -> np.ndarray:
    """Rotation after the time t of a free body with spin w, both in its frame."""

    def rate(y):
        spin, turn = y[:3], y[3:].reshape(3, 3)
        k = np.cross(np.eye(3), spin)  # columns w x e
        faster = np.linalg.solve(inertia, np.cross(inertia @ spin, spin))
        return np.concatenate([faster, (turn @ -k.T).ravel()])

    y, h = np.concatenate([w, np.eye(3).ravel()]), t / steps
    for _ in range(steps):  # Runge-Kutta of fourth order
        a = rate(y)
        b = rate(y + 0.5 * h * a)
        c = rate(y + 0.5 * h * b)
        y = y + h / 6.0 * (a + 2.0 * b + 2.0 * c + rate(y + h * c))
    return y[3:].reshape(3, 3)


def spinning(substeps: int, w, material=SOLID, **where):
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(DIE, material, angular_velocity=w, **where)
    return wc.Simulation(scene, substeps=substeps)


@pytest.mark.parametrize("material", [SOLID, LOADED])
def test_it_turns_over_as_the_equations_of_euler_say(material):
    solid = material.solid(DIE.vertices, DIE.tets)
    axes = np.linalg.eigh(solid.inertia)[1]
    w = axes @ [0.1, 12.0, 0.1]  # about the middle axis, which is unstable (Dzhanibekov)
    v, off = np.array([0.1, 0.0, -0.05]), []
    for substeps in (8, 32):
        sim = spinning(substeps, w, material, velocity=v)
        for _ in sim.frames(90):
            pass
        turn = euler(solid.inertia, w, 1.5, 6000)
        x = solid.centre + 1.5 * v + (DIE.vertices - solid.centre) @ turn.T
        off.append(np.abs(sim.positions() - x).max() / 0.05)
    # It has turned over: on its way the unstable axis magnifies steps and rounding.
    assert axes[:, 1] @ turn @ axes[:, 1] < 0.9
    assert max(off) < 5e-3


@pytest.mark.parametrize("material", [SOLID, LOADED])
def test_free_spin_keeps_momentum_energy_and_shape(material):
    sim = spinning(4, np.array([1.0, 12.0, 3.0]), material, velocity=(0.01, -0.005, 0.002))
    start, x = sim.measure(), sim.positions().astype(float)
    for _ in sim.frames(240):
        pass
    now, y = sim.measure(), sim.positions().astype(float)
    away = np.abs(now.angular_momentum - start.angular_momentum).max()
    # A walk of 960 steps, each of which rounds by 1e-7 and less.
    assert away < 2e-6 * np.abs(start.angular_momentum).max()
    fastest = np.abs(sim.velocities()).max() * sim.model.mass.numpy().sum()
    assert np.abs(now.momentum - start.momentum).max() < 1e-6 * fastest
    assert abs(now.kinetic / start.kinetic - 1.0) < 2e-3
    lengths = [np.linalg.norm(z[:, None] - z, axis=2) for z in (x, y)]
    assert np.abs(lengths[1] - lengths[0]).max() < 1e-7  # float32 positions of 0.1 m


def test_a_very_stiff_body_moves_as_a_rigid_one():
    def dropped(material):
        scene = wc.Scene(friction=0.3)
        scene.add_plane((0.0, 0.0, 1.0), 0.0)
        turned = np.array([0.2, 0.1, 0.05, 1.0])
        where, moves = (0.0, 0.0, 0.15), (0.5, 0.0, 0.0)
        turned /= np.linalg.norm(turned)
        scene.add_body(wc.box(0.1, 2), material, where, turned, velocity=moves)
        sim = wc.Simulation(scene, integrator="implicit", substeps=8)
        return np.array([sim.positions().mean(axis=0) for _ in sim.frames(60)])

    # A soft body has its mass at its vertices, and with it the moments of a larger box.
    m = np.bincount(wc.box(0.1, 2).tets.ravel(), np.repeat(250.0 * wc.box(0.1, 2).volumes, 4))
    moment = (m * np.square(wc.box(0.1, 2).vertices[:, :2]).sum(axis=1)).sum()
    rigid = dropped(wc.Rigid(mass=1.0, centre=(0, 0, 0), inertia=moment * np.eye(3)))
    stiff = dropped(wc.NeoHookean(1e12, 0.3, 1000.0))
    assert np.abs(rigid - stiff).max() < 1e-2 * 0.1


def test_rigid_and_soft_bodies_stand_on_each_other():
    scene = wc.Scene(friction=0.5)
    scene.add_plane((0.0, 0.0, 1.0), 0.0)
    soft = wc.NeoHookean(1e5, 0.3, 1000.0, 1e-3)
    for k in range(4):
        material = soft if k % 2 else wc.Rigid(1000.0)
        scene.add_body(wc.box(0.1, 2), material, (0.005 * k, 0.0, 0.0501 + 0.1005 * k))
    sim = wc.Simulation(scene)
    assert "rigid" in sim.summary()
    for _ in sim.frames(90):
        now = sim.measure()
        assert now.overlap < 1e-2 * sim.model.body_edge.numpy().min()
    weight = G * sim.model.mass.numpy().sum()
    # What is left of the swing of the soft ones.
    assert abs(now.forces["body0", "plane0"] / weight - 1.0) < 3e-3
    assert now.overlap < 1e-4 * sim.model.body_edge.numpy().min()
    rest = wc.box(0.1, 2).vertices
    for body in (0, 2):
        x = sim.positions(body).astype(float)
        assert (
            np.abs(np.linalg.norm(x[0] - x, axis=1) - np.linalg.norm(rest[0] - rest, axis=1)).max()
            < 1e-7
        )


def test_overlaps_at_the_start_are_resolved_and_the_rigid_side_keeps_its_shape():
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(wc.box(0.1, 2), wc.Rigid(1000.0))
    scene.add_body(wc.box(0.1, 2), wc.Rigid(3000.0), (0.02, 0.01, 0.09))
    scene.add_body(wc.box(0.1, 3), wc.NeoHookean(1e5, 0.3, 1000.0, 1e-3), (0.0, 0.0, -0.09))
    sim = wc.Simulation(scene)
    assert sim.measure().overlap > 5e-3
    for _ in sim.frames(15):
        pass
    now = sim.measure()
    assert now.overlap < 1e-4 * 0.03
    assert np.abs(now.momentum).max() < 1e-6


def test_forces_and_torques_act_for_a_frame():
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(wc.box(0.1, 2), wc.Rigid(1000.0), label="a")
    scene.add_body(wc.box(0.1, 2), wc.NeoHookean(1e6, 0.3, 1000.0), (1.0, 0.0, 0.0), label="b")
    sim = wc.Simulation(scene)
    mass = float(sim.model.mass.numpy()[:27].sum())
    x = sim.positions("a").astype(float)
    moment = mass * 0.1**2 / 6.0
    pushes = [0.3, -0.1, 0.5, 0.2]
    for push in pushes:
        sim.apply("a", (push, 0.0, 0.0), at=(0.0, 0.02, 0.0))
        sim.apply("b", (0.0, push, 0.0), torque=(0.0, 0.0, 1e-3))
        sim.step_frame()
    h = 1.0 / sim.fps
    speed, place = 0.0, 0.0
    for push in pushes:
        place += speed * h + 0.5 * push / mass * h * h
        speed += push / mass * h
    np.testing.assert_allclose(sim.velocities("a").mean(axis=0), [speed, 0, 0], atol=1e-6)
    np.testing.assert_allclose(sim.pose("a")[0], [place, 0, 0], atol=1e-6)
    np.testing.assert_allclose(sim.velocities("b").mean(axis=0), [0, speed, 0], atol=1e-6)
    spin = sim.velocities("a")[:, 1] @ x[:, 0] / (x[:, 0] @ x[:, 0])
    assert abs(spin / (-0.02 * sum(pushes) * h / moment) - 1.0) < 1e-3
    sim.step_frame()  # nothing acts any more
    np.testing.assert_allclose(sim.velocities("a").mean(axis=0), [speed, 0, 0], atol=1e-6)


def test_a_run_that_is_loaded_while_a_force_acts_goes_on_with_the_same_bits(tmp_path):
    def pushed(sim, frames):
        for _ in range(frames):
            sim.apply(0, (0.2, 0.0, 0.1), (0.0, 0.0, 1e-3))
            sim.step_frame()

    whole, half, again = spinning(4, (1, 2, 3)), spinning(4, (1, 2, 3)), spinning(4, (1, 2, 3))
    pushed(whole, 8)
    pushed(half, 5)
    half.save(tmp_path / "half.npz")
    again.load(tmp_path / "half.npz")
    pushed(again, 3)
    np.testing.assert_array_equal(again.positions(), whole.positions())
    whole.reset()
    pushed(whole, 8)
    np.testing.assert_array_equal(again.positions(), whole.positions())


def test_a_pose_is_what_was_set():
    sim = spinning(4, (0.0, 0.0, 0.0))
    turned = np.array([0.1, -0.2, 0.3, 0.9])
    turned /= np.linalg.norm(turned)
    sim.set_pose(0, (1.0, 2.0, 3.0), turned)
    place, found = sim.pose(0)
    np.testing.assert_allclose(place, [1.0, 2.0, 3.0], atol=1e-6)
    np.testing.assert_allclose(found, turned, atol=1e-5)
    for _ in sim.frames(3):
        pass
    np.testing.assert_allclose(sim.pose(0)[1], turned, atol=1e-5)


def test_what_a_rigid_body_cannot_do_is_refused_by_name():
    box, rigid = wc.box(0.1, 2), wc.Rigid(1000.0)
    with pytest.raises(ValueError, match=r"'tool'.*fixed"):
        wc.Scene().add_body(box, rigid, fixed=[0, 1], label="tool")
    scene = wc.Scene()
    scene.add_body(box, rigid, label="tool")
    with pytest.raises(ValueError, match="'tool' is rigid"):
        wc.Simulation(scene, wc.ContactSurface("literal"))
    with pytest.raises(ValueError, match="density"):
        wc.Rigid(-1.0)
    explicit = wc.Scene()
    explicit.add_body(box, wc.NeoHookean(1e5, 0.3, 1000.0), label="foam")
    with pytest.raises(ValueError, match=r"'foam'.*implicit"):
        wc.Simulation(explicit).apply("foam", (1.0, 0.0, 0.0))


def test_what_rests_sleeps_until_something_comes_and_stays_where_it_was(tmp_path):
    def run(sleeping, frames, load=None):
        scene = wc.Scene(friction=0.5)
        scene.add_plane((0.0, 0.0, 1.0))
        soft = wc.NeoHookean(1e5, 0.3, 1000.0, 1e-2)
        for k in range(4):
            material, place = soft if k % 2 else wc.Rigid(1000.0), (0.3 * (k // 2), 0.0)
            scene.add_body(wc.box(0.1, 2), material, (*place, 0.0501 + 0.1003 * (k % 2)))
        scene.add_body(wc.box(0.08, 2), soft, (0.0, 0.0, 8.0), label="late")
        sim = wc.Simulation(scene, sleeping=sleeping)
        if load:
            sim.load(load)
        awake = []
        for _ in sim.frames(frames):
            awake.append(int(sim._stepper.work.awake.bodies.numpy().sum()))
            if sleeping and sim.frame == 66 and not load:
                sim.save(tmp_path / "some_sleep.npz")
        return sim, awake

    sim, awake = run(True, 110)
    fully, _ = run(False, 110)
    # Both columns fall asleep, then the one that is struck wakes.
    assert min(awake) == 1 and awake[-1] == 3
    edge = sim.model.body_edge.numpy().min()
    for body in (2, 3):  # the other column has been struck
        assert np.abs(sim.positions(body) - fully.positions(body)).max() < 1e-2 * edge
    again, _ = run(True, 44, tmp_path / "some_sleep.npz")
    np.testing.assert_array_equal(again.positions(), sim.positions())
