"""Obstacles and rigid bodies made of surfaces: what touches them behaves as at a solid."""

import numpy as np
import pytest

import warp_contact as wc

G = 9.81
HELD = wc.Rigid(1000.0)  # of an obstacle nothing of the material counts
SOFT = wc.NeoHookean(1e5, 0.4, 1000.0, 2e-3)


def sheet(n: int, size: float = 1.0, z=lambda x, y: 0.0 * x) -> wc.Surface:
    """A square about the origin, n cells along each side, seen from above."""
    along = np.linspace(-0.5 * size, 0.5 * size, n + 1)
    x, y = np.meshgrid(along, along, indexing="ij")
    ids = np.arange(x.size).reshape(x.shape)
    a, b, c, d = ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]
    tris = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
    return wc.Surface(np.stack([x, y, z(x, y)], axis=-1).reshape(-1, 3), tris.reshape(-1, 3))


def run(sim: wc.Simulation, frames: int) -> wc.Simulation:
    for _ in sim.frames(frames):
        pass
    return sim


def resting(floor, integrator: str, size: float = 0.06) -> tuple[float, float]:
    """Height of the centre of a block [m], and the force of the floor over its weight."""
    scene = wc.Scene(friction=0.5)
    if floor is None:
        scene.add_plane((0.0, 0.0, 1.0))
    else:
        scene.add_body(floor, HELD, fixed=True, label="floor")
    at = (0.011, 0.007, 0.5 * size + 1e-4)
    block = scene.add_body(wc.box(size, 2), SOFT, at, label="block")
    sim, found = wc.Simulation(scene, integrator=integrator), []
    for _ in sim.frames(60):
        found.append([*sim.positions(block).mean(axis=0), sim.force_on(block)[2]])
    assert sim.measure().tunnelled == 0
    assert sim.measure().overlap < 1e-5  # the closure leaves 1e-4 of an edge
    x, y, z, force = np.mean(found[-20:], axis=0)
    assert np.hypot(x - at[0], y - at[1]) < 2e-4  # it slides nowhere
    return z, force / (G * SOFT.density * size**3)


@pytest.mark.parametrize("integrator", ["explicit", "implicit"])
def test_on_a_plate_from_a_file_a_block_rests_as_on_a_half_space(integrator, tmp_path):
    meshio = pytest.importorskip("meshio")
    plate = sheet(1)  # two triangles, a hundred times as large as those of the block
    triangles = [("triangle", plate.triangles)]
    meshio.write(tmp_path / "plate.stl", meshio.Mesh(1e3 * plate.vertices, triangles))
    floor = wc.shell(wc.Surface.load(tmp_path / "plate.stl", unit=1e-3), 0.01, "inside")
    solid = wc.box((1.0, 1.0, 0.1), (4, 4, 1)).transformed(np.eye(3), (0.0, 0.0, -0.05))
    z, force = resting(None, integrator)
    assert force == pytest.approx(1.0, abs=5e-3)  # it still swings a little
    assert resting(floor, integrator) == pytest.approx((z, force), abs=3e-6)
    # Friction holds a foot as it first stood: with other edges below, a quarter of the sag differs.
    assert resting(solid, integrator) == pytest.approx((z, force), abs=3e-5)


@pytest.mark.parametrize("kind", ["bowl", "heights"])
def test_a_ball_in_an_open_bowl_comes_to_rest_at_its_bottom(kind):
    scene = wc.Scene(friction=0.3)
    along = np.linspace(-0.2, 0.2, 17)
    heights = 2.0 * (along[:, None] ** 2 + along**2)
    bowl = wc.shell(sheet(16, 0.4, lambda x, y: 2.0 * (x * x + y * y)), 0.01, "inside")
    if kind == "heights":
        bowl = wc.heightfield(heights, 0.4, 0.01)
    scene.add_body(bowl, HELD, fixed=True)
    ball = scene.add_body(wc.sphere(0.03, 147), SOFT, (0.08, 0.05, 0.06))
    sim = wc.Simulation(scene, integrator="implicit")
    reached = [sim.positions(ball).mean(axis=0) for _ in sim.frames(240)]
    assert np.abs(reached[-1][:2]).max() < 0.012  # half a cell: facets, of the ball too
    assert 0.025 < reached[-1][2] < 0.035
    assert sim.force_on(ball)[2] / (G * sim.model.mass.numpy()[-147:].sum()) == pytest.approx(
        1, abs=0.1
    )
    assert sim.measure().tunnelled == 0 and sim.measure().overlap < 1e-4


@pytest.mark.parametrize("integrator", ["explicit", "implicit"])
def test_nothing_passes_a_thin_shell_and_explicit_steps_follow_its_thickness(integrator):
    steps = []
    for thickness in (4e-3, 1e-3):
        scene = wc.Scene()
        scene.add_body(wc.shell(sheet(3), thickness, "both"), HELD, fixed=True)
        soft = wc.NeoHookean(1e4, 0.4, 1000.0, 2e-3)
        ball = scene.add_body(wc.sphere(0.05, 41), soft, (0.02, 0.01, 0.06), velocity=(0, 0, -3))
        sim = wc.Simulation(scene, integrator=integrator)
        steps.append(max(sim.substeps for _ in sim.frames(12)))
        assert sim.measure().tunnelled == 0 and sim.positions(ball)[:, 2].min() > 0.0
    if integrator == "implicit":  # the ball is thick, and what went through is found
        assert steps[0] == steps[1] <= 8
    else:  # a quarter of the thickness in a step
        assert steps[0] > 3.0 / 60 / 4e-3 * 4 * 0.9
        assert 3.0 <= steps[1] / steps[0] <= 5.0


def hollow(density: float = 700.0) -> tuple[wc.TetMesh, wc.Rigid, wc.TetMesh]:
    """A shell of a closed surface, what its inside weighs, and the solid itself."""
    solid = wc.box((0.1, 0.2, 0.3), (2, 3, 4)).transformed(np.eye(3), (0.02, 0.0, 0.01))
    surface = wc.Surface(solid.vertices, solid.surface)
    return wc.shell(surface, 0.01, "inside"), surface.rigid(density), solid


def test_a_rigid_shell_moves_like_the_solid_that_its_surface_encloses():
    shell, weighs, solid = hollow()
    found = []
    for mesh, material in (shell, weighs), (solid, wc.Rigid(700.0)):
        scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
        body = scene.add_body(mesh, material, angular_velocity=(1.0, 2.0, 3.0))
        sim = wc.Simulation(scene)
        for _ in range(20):
            sim.apply(body, force=(3.0, 0.0, 0.0), torque=(0.0, 0.05, 0.0))
            sim.step_frame()
        found.append(np.concatenate(sim.pose(body)))
    np.testing.assert_allclose(*found, atol=1e-5)  # rounding of 20 frames


def test_a_rigid_shell_rests_with_all_of_its_weight():
    shell, weighs, _ = hollow()
    scene = wc.Scene(friction=0.5)
    scene.add_plane((0.0, 0.0, 1.0))
    body = scene.add_body(shell, weighs, (0.0, 0.0, 0.1401))
    sim = wc.Simulation(scene)
    force = [sim.force_on(body)[2] for _ in sim.frames(40)]
    assert np.mean(force[20:]) == pytest.approx(0.006 * 700.0 * G, rel=1e-2)
    assert sim.pose(body)[0][2] == pytest.approx(0.14, abs=1e-4)


@pytest.mark.parametrize("integrator", ["explicit", "implicit"])
def test_a_plate_that_is_moved_frame_by_frame_carries_a_block_at_its_velocity(integrator):
    scene = wc.Scene(friction=0.8)
    plate = scene.add_body(wc.shell(sheet(2, 0.3), 0.01, "inside"), HELD, fixed=True)
    block = scene.add_body(wc.box(0.06, 2), SOFT, (0.0, 0.0, 0.0301))
    sim = run(wc.Simulation(scene, integrator=integrator), 20)
    start, at, k = sim.positions(plate), sim.positions(block).mean(axis=0), 0
    for k in range(1, 61):  # by a fifth of a metre, smoothly
        s = k / 60
        way = np.float32([0.1, 0.0, 0.2]) * np.float32(s * s * (3.0 - 2.0 * s))
        sim.move_to(plate, start + way)
        sim.step_frame()
        if k == 30:
            v = np.array([0.1, 0.0, 0.2]) * 1.5
            np.testing.assert_allclose(sim.velocities(plate), np.tile(v, (18, 1)), atol=2e-3)
            # It lags by the time in which it swings once, at up to 1.2 m/s^2.
            np.testing.assert_allclose(sim.velocities(block).mean(axis=0), v, atol=0.03)
    moved = run(sim, 20).positions(block).mean(axis=0) - at
    np.testing.assert_allclose(moved, [0.1, 0.0, 0.2], atol=2e-3)
    np.testing.assert_array_equal(sim.positions(plate), start + way)


def test_what_sleeps_on_a_plate_is_woken_and_carried_by_it():
    scene = wc.Scene(friction=0.8)
    plate = scene.add_body(wc.shell(sheet(1, 0.3), 0.01, "inside"), HELD, fixed=True)
    dull = wc.NeoHookean(1e5, 0.4, 1000.0, 8e-3)
    block = scene.add_body(wc.box(0.06, 2), dull, (0.0, 0.0, 0.0301))
    sim = run(wc.Simulation(scene, sleeping=True), 90)
    low = sim.positions(block)[:, 2].mean()
    assert not sim._stepper.work.awake.bodies.numpy().any()
    sim.move_to(plate, pose=((0.0, 0.0, 0.05), (0.0, 0.0, 0.0, 1.0)), over=30)
    run(sim, 45)
    assert sim.positions(block)[:, 2].mean() - low == pytest.approx(0.05, abs=1e-4)


def test_a_surface_that_changes_its_shape_pushes_and_has_no_energy(tmp_path):
    surface = sheet(4, 0.3)
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    shell = wc.shell(surface, 0.01, "inside")
    bed = scene.add_body(shell, SOFT, fixed=True)  # not rigid: it bends
    block = scene.add_body(wc.box(0.06, 2), SOFT, (0.0, 0.0, 0.0301))
    sim = wc.Simulation(scene)
    for k in range(1, 21):
        x = surface.vertices.copy()
        x[:, 2] += 0.03 * k / 20 * np.exp(-(x**2).sum(axis=1) / 0.02)
        sim.move_to(bed, wc.shell(surface.moved(x), 0.01, "inside").vertices)
        sim.step_frame()
    assert sim.positions(bed)[:, 2].max() == pytest.approx(0.03)
    assert sim.positions(block)[:, 2].min() > 0.02
    # That of the block alone, which was pushed at 0.1 m/s: far more if the bed counted.
    assert sim.measure().elastic < 1e-3


def test_a_run_that_was_written_moves_an_obstacle_in_another_one(tmp_path):
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(wc.box(0.1, 2), SOFT, velocity=(0.0, 0.0, 0.5))
    sim = wc.Simulation(scene)
    with wc.UsdWriter(tmp_path / "first", sim) as usd:
        usd.write()
        for _ in sim.frames(10):
            usd.write()

    surface = wc.Surface.load(tmp_path / "first/first.usda")
    frames = wc.Surface.load_frames(tmp_path / "first/first.usda", fps=60)
    scene = wc.Scene(gravity=(0.0, 0.0, 0.0))
    scene.add_body(wc.shell(surface, 0.02, "inside"), SOFT, fixed=True)
    sim, n = wc.Simulation(scene), len(surface.vertices)
    for x in frames[1:]:
        sim.move_to(0, wc.shell(surface.moved(x), 0.02, "inside").vertices)
        sim.step_frame()
        # Rounding of positions of 0.1 m, sixty times a second.
        np.testing.assert_allclose(sim.velocities(0)[n:, 2], 0.5, atol=2e-5)
    assert len(frames) == 11
    np.testing.assert_allclose(sim.positions(0)[n:], frames[10], atol=1e-8)
    assert frames[10][:, 2].mean() == pytest.approx(0.5 * 10 / 60, abs=1e-5)
