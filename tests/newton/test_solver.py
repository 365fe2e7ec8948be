"""newton/: a model of Newton is simulated as it says, or refused by name."""

import numpy as np
import pytest

newton = pytest.importorskip("newton", "1.8")
import warp as wp  # noqa: E402

from warp_contact.newton import SolverContactSurface  # noqa: E402

DT = 1.0 / 240.0
SIZE, CELLS = 0.1, 2  # of a block [m]
DENSITY = 1000.0
NONE = (0.0, 0.0, 0.0)
STILL = wp.quat_identity()
GRID = {"dim_x": CELLS, "dim_y": CELLS, "dim_z": CELLS, "density": DENSITY}
GRID |= {f"cell_{axis}": SIZE / CELLS for axis in "xyz"}
GRID |= {"k_mu": 5e4, "k_lambda": 1e5, "k_damp": 200.0}


def add_block(builder, at, velocity=(0.0, 0.0, 0.0), **more) -> None:
    builder.add_soft_grid(pos=wp.vec3(*at), rot=STILL, vel=wp.vec3(*velocity), **(GRID | more))


class Run:
    """A model with a solver, one state after the other."""

    def __init__(self, builder, device, **settings):
        self.model = builder.finalize(device=device)
        self.solver = SolverContactSurface(self.model, **settings)
        self.now, self.then = self.model.state(), self.model.state()
        self.seen = self.solver.observables(self.solver.supported_observables)

    def step(self, n: int = 1, dt: float = DT) -> None:
        for _ in range(n):
            self.solver.step(self.now, self.then, None, None, dt, observables=self.seen)
            self.now, self.then = self.then, self.now

    @property
    def x(self) -> np.ndarray:
        return self.now.particle_q.numpy().copy()

    @property
    def force(self) -> np.ndarray:
        return self.seen.particle_contact_f.numpy().astype(float)


@pytest.mark.parametrize("up", "YZ")
def test_a_block_rests_on_the_ground_and_its_force_is_its_weight(device, up):
    axis = "XYZ".index(up)
    builder = newton.ModelBuilder(up_axis=newton.Axis[up])
    builder.add_ground_plane()
    at = np.zeros(3)
    at[axis] = 1e-4
    add_block(builder, at)
    run = Run(builder, device)
    run.step(120)
    mass = run.model.particle_mass.numpy().sum()
    want = mass * 9.81 * np.eye(3)[axis]
    # At rest to what is left of its vibrations.
    np.testing.assert_allclose(run.force.sum(axis=0), want, atol=5e-3 * mass * 9.81)
    low = run.x[:, axis] < 0.1 * SIZE
    assert (run.force[~low] == 0.0).all() and (run.seen.particle_pressure.numpy()[low] > 0.0).all()
    assert 0.0 <= run.x[:, axis].min() < 2e-5  # the resting gap: 2e-4 edges
    assert np.abs(run.now.particle_qd.numpy()).max() < 1e-2


def test_soft_on_soft_has_opposite_forces(device):
    builder = newton.ModelBuilder(gravity=NONE)
    add_block(builder, (0.0, 0.0, 0.0))
    add_block(builder, (0.02, 0.01, SIZE + 1e-4), (0.0, 0.0, -0.3))
    run = Run(builder, device)
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
def test_a_beam_sags_as_with_the_solver_of_newton(device, damping):
    builder = newton.ModelBuilder()
    more = {"dim_x": 4, "k_damp": damping, "fix_left": True}
    add_block(builder, (0.0, 0.0, 1.0), **more)
    share = Run(builder, device)
    share.step()
    held = np.array(builder.particle_mass) == 0.0
    mass = share.solver.simulation.model.mass.numpy().astype(float)
    builder.particle_mass = np.where(held, 0.0, mass).tolist()  # Newton divides it otherwise
    builder.color()
    ours = Run(builder, device)
    ours.step(24)
    theirs = Run(builder, device)
    theirs.solver = newton.solvers.SolverVBD(theirs.model, iterations=20)
    theirs.seen = None
    theirs.step(24 * 4, DT / 4.0)
    start = ours.model.particle_q.numpy()
    sag = start[:, 2] - ours.x[:, 2]
    assert sag.max() > 0.01
    lame = ours.solver.simulation.model.materials[0].lame()
    np.testing.assert_allclose(lame, [GRID["k_mu"], GRID["k_lambda"]], rtol=1e-6)
    # Its viscous stress has no Poisson ratio, and implicit Euler damps by itself: seen 4 %.
    np.testing.assert_allclose(theirs.x, ours.x, atol=0.06 * sag.max())


def test_held_particles_follow_what_is_written_into_the_state(device, monkeypatch):
    builder = newton.ModelBuilder(gravity=NONE)
    add_block(builder, (0.0, 0.0, 0.0), fix_left=True)
    run = Run(builder, device)
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


def test_what_is_written_into_a_state_is_where_it_goes_on(device, rng):
    builder = newton.ModelBuilder(gravity=NONE)
    add_block(builder, (0.0, 0.0, 0.0))
    run = Run(builder, device)
    run.step()
    shift, v = rng.uniform(-1.0, 1.0, (2, 3)).astype(np.float32)
    run.now.particle_q.assign(run.x + shift)
    run.now.particle_qd.assign(np.tile(v, (run.model.particle_count, 1)))
    mass = run.solver.simulation.model.mass.numpy()[:, None]
    run.now.particle_f.assign(mass * v)
    run.step(dt=0.5 * DT)  # another length of the step too
    want = run.model.particle_q.numpy() + shift + 0.5 * DT * v * (1.0 + 0.5 * DT)
    np.testing.assert_allclose(run.x, want, atol=1e-6)  # rounding


def test_a_reset_gives_the_bits_of_the_first_steps_in_chosen_worlds(device):
    block = newton.ModelBuilder()
    block.add_ground_plane()
    add_block(block, (0.0, 0.0, 1e-4))
    block.add_shape_box(
        -1, xform=wp.transform(wp.vec3(0.5, 0.0, 0.05), STILL), hx=0.1, hy=0.1, hz=0.05
    )
    builder = newton.ModelBuilder()
    builder.replicate(block, 2)
    run = Run(builder, device)
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
    # Its damping still holds the force of the step before: seen 4e-4 of the block.
    np.testing.assert_allclose(run.x[:n], first[:n], atol=1e-3 * SIZE)
    assert np.abs(run.x[n:] - first[n:]).max() > 1e-5


def add_ball(builder, at, radius=0.05, **more) -> int:
    ball = builder.add_body(xform=wp.transform(wp.vec3(*at), STILL), **more)
    builder.add_shape_sphere(ball, radius=radius)
    return ball


def test_a_rigid_ball_falls_turns_and_is_pushed(device):
    builder = newton.ModelBuilder()
    add_block(builder, (1.0, 0.0, 0.0))
    add_ball(builder, (0.0, 0.0, 0.0))
    run = Run(builder, device)
    mass = float(run.model.body_mass.numpy()[0])
    spin = np.array([[0.1, 0.0, 0.0, 0.0, 3.0, 0.0]], dtype=np.float32)
    run.now.body_qd.assign(spin)
    run.now.body_f.assign(np.array([[0.0, mass, 0.0, 0.0, 0.0, 0.0]], dtype=np.float32))
    run.step()
    run.then.body_f.zero_()
    run.step(9)
    time = 10 * DT
    want = [0.1, DT, -9.81 * time, 0.0, 3.0, 0.0]
    np.testing.assert_allclose(run.now.body_qd.numpy()[0], want, atol=1e-4)  # fitted in float32
    q = run.now.body_q.numpy()[0]
    want = [0.1 * time, DT * (time - 0.5 * DT), -0.5 * 9.81 * time**2]
    np.testing.assert_allclose(q[:3], want, atol=2e-5)
    np.testing.assert_allclose(q[3:], [0, np.sin(1.5 * time), 0, np.cos(1.5 * time)], atol=1e-4)


def test_a_driven_body_pushes_a_soft_one(device):
    builder = newton.ModelBuilder(gravity=NONE)
    add_block(builder, (0.0, 0.0, 0.0))
    add_ball(builder, (-0.06, 0.05, 0.05), is_kinematic=True)
    run = Run(builder, device)
    for k in range(10):
        pose = run.now.body_q.numpy().copy()
        pose[0, 0] = -0.06 + 0.002 * (k + 1)
        run.now.body_q.assign(pose)
        run.step()
    assert run.force.sum(axis=0)[0] > 0.0 and run.now.body_q.numpy()[0, 0] == pose[0, 0]
    assert run.now.particle_qd.numpy()[:, 0].mean() > 0.0


@pytest.mark.parametrize("shape", ["box", "sphere", "cylinder", "capsule", "mesh", "plane"])
def test_a_static_shape_holds_a_block(device, shape):
    builder = newton.ModelBuilder()
    below = wp.transform(wp.vec3(0.05, 0.05, -0.2), STILL)
    if shape == "mesh":
        builder.add_shape_mesh(-1, xform=below, mesh=newton.Mesh.create_box(0.2, 0.2, 0.2))
    else:
        size = {"box": {"hx": 0.2, "hy": 0.2, "hz": 0.2}, "sphere": {"radius": 0.2}}
        size |= {"cylinder": {"radius": 0.2, "half_height": 0.2}}
        size |= {"capsule": {"radius": 0.15, "half_height": 0.05}}
        size |= {"plane": {"width": 0.4, "length": 0.4, "plane": None}}
        at = wp.transform(wp.vec3(0.05, 0.05, 0.0), STILL) if shape == "plane" else below
        getattr(builder, f"add_shape_{shape}")(xform=at, **{"body": -1} | size[shape])
    add_block(builder, (0.0, 0.0, 1e-3))
    run = Run(builder, device)
    run.step(40)
    assert run.force[:, 2].sum() > 0.0 and run.x[:, 2].min() > -0.01  # a ball dents it


def _joint(builder):
    ball = builder.add_link()
    builder.add_shape_sphere(ball, radius=0.1)
    builder.add_joint_revolute(-1, ball, label="hinge")


def _two_shapes(builder):
    builder.add_shape_box(add_ball(builder, (0.0, 0.0, 1.0), label="twin"), hx=0.1, hy=0.1, hz=0.1)


def _materials(builder):
    add_block(builder, (0.5, 0.0, 0.0), label="patched")
    builder.tet_materials[-1] = (1e6, 1e6, 0.0)


REFUSED = {
    "hinge": _joint,
    "'twin'.* has 2 shapes": _two_shapes,
    "patched has tets of several materials": _materials,
    "CONE": lambda b: b.add_shape_cone(-1, radius=0.1, half_height=0.1),
    "particles 27 belong to no tet": lambda b: b.add_particle(wp.vec3(), wp.vec3(), 1.0),
    "1 springs": lambda b: b.add_spring(0, 1, 1.0, 1.0, 0.0),
    "tri_materials": lambda b: add_block(b, (0.5, 0.0, 0.0), tri_ke=1.0),
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_cannot_be_simulated_is_refused_by_name(device, message):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0))
    REFUSED[message](builder)
    with pytest.raises(ValueError, match=message):
        SolverContactSurface(builder.finalize(device=device))


def test_a_plane_of_one_world_alone_is_refused(device):
    builder = newton.ModelBuilder()
    for ground in True, False:
        one = newton.ModelBuilder()
        add_block(one, (0.0, 0.0, 0.0))
        if ground:
            one.add_ground_plane()
        builder.add_world(one)
    with pytest.raises(ValueError, match="is not in all worlds"):
        SolverContactSurface(builder.finalize(device=device))


def test_a_capture_is_an_error_and_leaves_the_solver_as_it_was(device):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0))
    run = Run(builder, device)
    with pytest.raises(RuntimeError, match="cannot be captured"), wp.ScopedCapture(device):
        run.step()
    run.step()
    assert run.x[:, 2].min() < 0.0


def test_after_a_step_that_fails_the_next_one_begins_where_its_state_is(device, monkeypatch):
    builder = newton.ModelBuilder(gravity=NONE)
    add_block(builder, (0.0, 0.0, 0.0))
    add_ball(builder, (0.0, 0.0, 1.0))
    run = Run(builder, device)
    run.step()
    x, pose = run.x, run.now.body_q.numpy().copy()
    for state in run.now, run.then:
        state.particle_q.assign(x + np.float32(1.0))
        state.body_q.assign(pose + np.eye(1, 7, dtype=np.float32))
    with monkeypatch.context() as m:
        m.setattr(type(run.solver.simulation), "step_frame", lambda self: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            run.step()
    run.now.particle_q.assign(x)
    run.now.body_q.assign(pose)
    run.step()
    np.testing.assert_allclose(run.x, x, atol=1e-6)  # rounding
    np.testing.assert_allclose(run.now.body_q.numpy(), pose, atol=1e-6)


def test_a_model_that_changes_is_translated_anew(device):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0))
    run = Run(builder, device)
    run.step()
    x = run.x
    run.model.set_gravity((0.0, 0.0, 0.0))
    run.solver.notify_model_changed(newton.ModelFlags.MODEL_PROPERTIES)
    run.step()
    np.testing.assert_allclose(run.x - x, [[0.0, 0.0, -9.81 * DT**2]] * len(x), atol=1e-7)
