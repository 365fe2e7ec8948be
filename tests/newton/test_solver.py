"""newton/solver.py: soft bodies of a model of Newton move as it says."""

import numpy as np
import pytest

newton = pytest.importorskip("newton", "1.8")
import warp as wp  # noqa: E402

NONE = (0.0, 0.0, 0.0)
STILL = wp.quat_identity()
DT = 1.0 / 240.0
SIZE = 0.1  # of a block [m]


@pytest.mark.parametrize("up", "YZ")
def test_a_block_rests_on_the_ground_and_its_force_is_its_weight(device, up, add_block, run_of):
    axis = "XYZ".index(up)
    builder = newton.ModelBuilder(up_axis=newton.Axis[up])
    builder.add_ground_plane()
    at = np.zeros(3)
    at[axis] = 1e-4
    add_block(builder, at)
    run = run_of(builder, device)
    run.step(120)
    mass = run.model.particle_mass.numpy().sum()
    want = mass * 9.81 * np.eye(3)[axis]
    # At rest to what is left of its vibrations.
    np.testing.assert_allclose(run.force.sum(axis=0), want, atol=5e-3 * mass * 9.81)
    low = run.x[:, axis] < 0.1 * SIZE
    assert (run.force[~low] == 0.0).all() and (run.seen.particle_pressure.numpy()[low] > 0.0).all()
    assert 0.0 <= run.x[:, axis].min() < 2e-5  # the resting gap: 2e-4 edges
    assert np.abs(run.now.particle_qd.numpy()).max() < 1e-2


def test_soft_on_soft_has_opposite_forces(device, add_block, run_of):
    builder = newton.ModelBuilder(gravity=NONE)
    add_block(builder, (0.0, 0.0, 0.0))
    add_block(builder, (0.02, 0.01, SIZE + 1e-4), (0.0, 0.0, -0.3))
    run = run_of(builder, device)
    n, seen = run.model.particle_count // 2, []
    for _ in range(20):  # until they part again
        run.step()
        seen.append([run.force[:n].sum(axis=0), run.force[n:].sum(axis=0)])
    lower, upper = np.array(seen).swapaxes(0, 1)
    assert upper[:, 2].max() > 0.0 and not upper[-1].any()
    # Rounding of impulses to float32.
    np.testing.assert_allclose(lower, -upper, atol=1e-5 * upper.max())
    mass = run.solver.simulation.model.mass.numpy()[n:, None].astype(float)
    assert mass.sum() == pytest.approx(run.model.particle_mass.numpy()[n:].sum(), rel=1e-5)
    gained = (mass * (run.now.particle_qd.numpy()[n:] - [0.0, 0.0, -0.3])).sum(axis=0)
    np.testing.assert_allclose(upper.sum(axis=0) * DT, gained, atol=1e-4 * gained.max())


@pytest.mark.parametrize("damping", [20.0, 2000.0])
def test_a_beam_sags_as_with_the_solver_of_newton(device, damping, add_block, run_of):
    builder = newton.ModelBuilder()
    more = {"dim_x": 4, "k_damp": damping, "fix_left": True}
    add_block(builder, (0.0, 0.0, 1.0), **more)
    share = run_of(builder, device)
    share.step()
    held = np.array(builder.particle_mass) == 0.0
    mass = share.solver.simulation.model.mass.numpy().astype(float)
    builder.particle_mass = np.where(held, 0.0, mass).tolist()  # Newton divides it otherwise
    builder.color()
    ours = run_of(builder, device)
    ours.step(24)
    theirs = run_of(builder, device)
    theirs.solver = newton.solvers.SolverVBD(theirs.model, iterations=20)
    theirs.seen = None
    theirs.step(24 * 4, DT / 4.0)
    start = ours.model.particle_q.numpy()
    sag = start[:, 2] - ours.x[:, 2]
    assert sag.max() > 0.01
    lame = ours.solver.simulation.model.materials[0].lame()
    np.testing.assert_allclose(lame, ours.model.tet_materials.numpy()[0, :2], rtol=1e-6)
    # Its viscous stress has no Poisson ratio, and implicit Euler damps by itself: seen 4 %.
    np.testing.assert_allclose(theirs.x, ours.x, atol=0.06 * sag.max())


def test_held_particles_follow_what_is_written_into_the_state(
    device, monkeypatch, add_block, run_of
):
    builder = newton.ModelBuilder(gravity=NONE)
    add_block(builder, (0.0, 0.0, 0.0), fix_left=True)
    run = run_of(builder, device)
    held = run.model.particle_mass.numpy() == 0.0
    run.step(2)
    np.testing.assert_allclose(run.x, run.model.particle_q.numpy(), atol=1e-9)  # rounding
    goal = run.x
    goal[held] += [0.0, 0.0, 1e-3]
    run.now.particle_q.assign(goal)
    monkeypatch.setattr(run.solver.simulation, "set_positions", None)  # that is no motion
    run.step()
    np.testing.assert_array_equal(run.x[held], goal[held])
    masses = run.model.particle_mass.numpy(), run.solver.simulation.model.mass.numpy()[~held]
    assert masses[1].sum() == pytest.approx(masses[0].sum(), rel=1e-5)  # rounding
    run.step(100)
    np.testing.assert_allclose(run.x, run.model.particle_q.numpy() + [0, 0, 1e-3], atol=1e-4)


def test_what_is_written_into_a_state_is_where_it_goes_on(device, rng, add_block, run_of):
    builder = newton.ModelBuilder(gravity=NONE)
    add_block(builder, (0.0, 0.0, 0.0))
    run = run_of(builder, device)
    run.step()
    shift, v = rng.uniform(-1.0, 1.0, (2, 3)).astype(np.float32)
    run.now.particle_q.assign(run.x + shift)
    run.now.particle_qd.assign(np.tile(v, (run.model.particle_count, 1)))
    mass = run.solver.simulation.model.mass.numpy()[:, None]
    run.now.particle_f.assign(mass * v)
    run.step(dt=0.5 * DT)  # another length of the step too
    want = run.model.particle_q.numpy() + shift + 0.5 * DT * v * (1.0 + 0.5 * DT)
    np.testing.assert_allclose(run.x, want, atol=1e-6)  # rounding


def test_a_reset_gives_the_bits_of_the_first_steps_in_chosen_worlds(device, add_block, run_of):
    block = newton.ModelBuilder()
    block.add_ground_plane()
    add_block(block, (0.0, 0.0, 1e-4))
    block.add_shape_box(
        -1, xform=wp.transform(wp.vec3(0.5, 0.0, 0.05), STILL), hx=0.1, hy=0.1, hz=0.05
    )
    builder = newton.ModelBuilder()
    builder.replicate(block, 2)
    run = run_of(builder, device)
    n = run.model.particle_count // 2
    run.step(3)
    first = run.x
    np.testing.assert_array_equal(first[:n], first[n:])
    run.now.assign(run.model.state())
    run.solver.reset(run.now)
    run.step(3)
    np.testing.assert_array_equal(run.x, first)
    q, v = run.x, run.now.particle_qd.numpy().copy()
    q[:n], v[:n] = run.model.particle_q.numpy()[:n], 0.0
    run.now.particle_q.assign(q)
    run.now.particle_qd.assign(v)
    run.solver.reset(run.now, wp.array([True, False, False], dtype=wp.bool, device=device))
    run.step(3)
    # Rounding of the velocities that are set.
    np.testing.assert_allclose(run.x[:n], first[:n], atol=1e-6)
    assert np.abs(run.x[n:] - first[n:]).max() > 1e-5


def test_a_reset_writes_what_its_flags_name_into_the_state(device, add_block, run_of):
    block = newton.ModelBuilder()
    add_block(block, (0.0, 0.0, 0.0))
    ball = block.add_body(xform=wp.transform(wp.vec3(1.0, 0.0, 0.0), STILL))
    block.add_shape_sphere(ball, radius=0.05)
    builder = newton.ModelBuilder()
    builder.replicate(block, 2)
    run = run_of(builder, device)
    run.step(3)
    n, flags = run.model.particle_count // 2, newton.StateFlags
    ours = run.now
    before = [a.numpy().copy() for a in (ours.particle_q, ours.particle_qd, ours.body_q)]
    run.solver.reset(ours, flags=0)
    np.testing.assert_array_equal(ours.particle_q.numpy(), before[0])
    first = wp.array([True, False, False], dtype=wp.bool, device=device)
    run.solver.reset(ours, first, flags=flags.PARTICLE_Q | flags.BODY_Q)
    np.testing.assert_array_equal(ours.particle_q.numpy()[:n], run.model.particle_q.numpy()[:n])
    np.testing.assert_array_equal(ours.particle_q.numpy()[n:], before[0][n:])
    np.testing.assert_array_equal(ours.particle_qd.numpy(), before[1])
    assert (ours.body_q.numpy()[:, 2] == [0.0, before[2][1, 2]]).all() and before[2][0, 2] < 0.0
    run.solver.reset(ours)
    for name in "particle_q", "particle_qd", "body_q", "body_qd":
        np.testing.assert_array_equal(
            getattr(ours, name).numpy(), getattr(run.model, name).numpy(), err_msg=name
        )


def test_no_particle_leaves_a_step_faster_than_the_model_lets_it(device, add_block, run_of):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0), (3.0, 0.0, 0.0))
    run = run_of(builder, device)
    run.model.particle_max_velocity = 2.0
    run.step()
    seen = np.linalg.norm(run.now.particle_qd.numpy(), axis=1)
    np.testing.assert_allclose(seen, 2.0, rtol=1e-5)
    x = run.x
    run.step()
    way = np.linalg.norm(run.x - x, axis=1)
    np.testing.assert_allclose(way, 2.0 * DT, rtol=1e-3)  # and what gravity adds in a step


def test_accelerations_of_bodies_are_observed(device, add_block, run_of):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0))
    for x, driven in ((1.0, False), (2.0, True)):
        at = wp.transform(wp.vec3(x, 0.0, 0.0), STILL)
        builder.add_shape_sphere(builder.add_body(xform=at, is_kinematic=driven), radius=0.05)
    run = run_of(builder, device)
    run.step(2)
    want = [[0.0, 0.0, -9.81, 0.0, 0.0, 0.0], [0.0] * 6]
    np.testing.assert_allclose(run.seen.body_qdd.numpy(), want, atol=5e-3)  # of fits in float32
    run.seen.body_qdd.zero_()
    run.then = run.now  # in place
    run.step()
    np.testing.assert_allclose(run.seen.body_qdd.numpy(), want, atol=5e-3)


def test_a_capture_is_an_error_and_leaves_the_solver_as_it_was(device, add_block, run_of):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0))
    run = run_of(builder, device)
    with pytest.raises(RuntimeError, match="cannot be captured"), wp.ScopedCapture(device):
        run.step()
    for what, given in (("reset", run.now), ("notify_model_changed", 1)):
        with pytest.raises(RuntimeError, match=f"{what} works"), wp.ScopedCapture(device):
            getattr(run.solver, what)(given)
    run.step()
    assert run.x[:, 2].min() < 0.0


def test_a_model_that_changes_is_translated_anew(device, add_block, run_of):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0))
    run = run_of(builder, device)
    run.step()
    x = run.x
    run.model.set_gravity((0.0, 0.0, 0.0))
    run.solver.notify_model_changed(newton.ModelFlags.MODEL_PROPERTIES)
    run.step()
    np.testing.assert_allclose(run.x - x, [[0.0, 0.0, -9.81 * DT**2]] * len(x), atol=1e-7)
