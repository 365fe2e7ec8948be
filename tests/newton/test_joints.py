"""newton/joints.py: joints of a model hold its bodies, forces along them move these."""

import numpy as np
import pytest

newton = pytest.importorskip("newton", "1.8")
import warp as wp  # noqa: E402

from warp_contact.newton import SolverContactSurface  # noqa: E402
from warp_contact.scene.scene import rotation_matrix  # noqa: E402

NONE = (0.0, 0.0, 0.0)
DT = 1.0 / 240.0
FAR = (5.0, 0.0, 0.0)  # of the block, which every model has


def add_link(builder, half=0.05, **more) -> int:
    link = builder.add_link(**more)
    builder.add_shape_box(link, hx=half, hy=half, hz=half)
    return link


def at(x=0.0, y=0.0, z=0.0, turn=(0.0, 0.0, 0.0, 1.0)):
    return wp.transform(wp.vec3(x, y, z), wp.quat(*turn))


def pair(kind, **more):
    """Two free bodies 0.3 m apart along x, with a joint ``kind`` in their midst."""
    builder = newton.ModelBuilder(gravity=NONE)
    a, b = add_link(builder), add_link(builder, xform=at(0.3))
    ends = {"parent_xform": at(0.15), "child_xform": at(-0.15), "label": "between"}
    joints = [builder.add_joint_free(a)]
    joints += [getattr(builder, f"add_joint_{kind}")(a, b, **(ends | more))]
    builder.add_articulation(joints)
    builder.joint_q[:3] = [0.0, 0.0, 0.0]
    return builder


def frames_of(run):
    """Place and rotation of the joint of a ``pair``, of its parent and of its child."""
    for q, x in zip(run.now.body_q.numpy(), (0.15, -0.15), strict=True):
        turn = rotation_matrix(q[3:].astype(float))
        yield q[:3] + turn @ [x, 0.0, 0.0], turn


def momentum_of(run) -> np.ndarray:
    """Momentum and angular momentum about the origin, of boxes."""
    q, qd = run.now.body_q.numpy().astype(float), run.now.body_qd.numpy().astype(float)
    m, inertia = run.model.body_mass.numpy().astype(float), run.model.body_inertia.numpy()
    p = m[:, None] * qd[:, :3]
    spin = np.cross(q[:, :3], p) + inertia[:, 0, 0, None] * qd[:, 3:]  # that of a cube
    return np.concatenate([p.sum(axis=0), spin.sum(axis=0)])


def test_a_pendulum_swings_as_its_equation_says(device, add_block, run_of):
    builder = newton.ModelBuilder()
    add_block(builder, FAR)
    link = add_link(builder)
    hinge = builder.add_joint_revolute(
        -1, link, parent_xform=at(z=1.0), child_xform=at(z=0.3), axis=newton.Axis.Y
    )
    builder.add_articulation([hinge])
    builder.joint_q[-1] = start = 1.0  # where body_q of the model does not have it
    run = run_of(builder, device)
    newton.eval_fk(run.model, run.model.joint_q, run.model.joint_qd, run.now)
    run.step(60)
    mass, turns = run.model.body_mass.numpy()[0], run.model.body_inertia.numpy()[0, 1, 1]
    rate = mass * 9.81 * 0.3 / (turns + mass * 0.3**2)
    angle, speed, h = start, 0.0, DT / 100.0
    for _ in range(6000):
        speed -= h * rate * np.sin(angle)
        angle += h * speed
    q = run.now.body_q.numpy()[0]
    want = np.array([-0.3 * np.sin(angle), 0.0, 1.0 - 0.3 * np.cos(angle)])
    # Of a way of 0.24 m; steps of 1/240 s are of second order.
    np.testing.assert_allclose(q[:3], want, atol=2e-4)
    np.testing.assert_allclose(np.linalg.norm(q[:3] - [0.0, 0.0, 1.0]), 0.3, atol=1e-5)
    np.testing.assert_allclose(run.now.body_qd.numpy()[0, 4], speed, atol=5e-3)


@pytest.mark.parametrize("kind", ["fixed", "ball", "revolute", "prismatic"])
def test_a_joint_holds_what_it_should_and_nothing_else(device, kind, rng, add_block, run_of):
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    frame = wp.normalize(wp.quat(*rng.normal(size=4)))
    more = {"axis": wp.vec3(*axis)} if kind in ("revolute", "prismatic") else {}
    builder = pair(
        kind, parent_xform=at(0.15, turn=frame), child_xform=at(-0.15, turn=frame), **more
    )
    axis = rotation_matrix(np.array(frame, dtype=float)) @ axis  # in the frame of either body
    add_block(builder, FAR)
    run = run_of(builder, device)
    qd = rng.uniform(-1.0, 1.0, (2, 6)).astype(np.float32)
    run.now.body_qd.assign(qd)
    run.step()
    before = momentum_of(run)
    run.step(24)
    (a, turn), (b, other) = frames_of(run)
    moved, turned = turn.T @ (b - a), turn.T @ other
    if kind == "prismatic":
        assert abs(moved @ axis) > 5e-5  # some draws slide that slowly; across it is 2e-5 at most
        moved = moved - axis * (axis @ moved)
    np.testing.assert_allclose(moved, 0.0, atol=2e-5)
    if kind in ("fixed", "prismatic"):
        np.testing.assert_allclose(turned, np.eye(3), atol=2e-4)  # 2e-5 m on an arm of 0.15
    else:
        assert np.abs(turned - np.eye(3)).max() > 1e-3
    if kind == "revolute":
        np.testing.assert_allclose(turned @ axis, axis, atol=2e-4)
    # Forces are opposite; angular momentum as of free bodies that turn.
    np.testing.assert_allclose(momentum_of(run), before, atol=1e-3 * np.abs(before).max())


def test_a_body_fixed_to_the_world_stays_and_carries_a_block(device, add_block, run_of):
    builder = newton.ModelBuilder()
    table = add_link(builder, 0.2)
    builder.add_articulation([builder.add_joint_fixed(-1, table, parent_xform=at(z=-0.2))])
    add_block(builder, (-0.05, -0.05, 1e-4))
    run = run_of(builder, device)
    newton.eval_fk(run.model, run.model.joint_q, run.model.joint_qd, run.now)
    start = run.now.body_q.numpy().copy()
    run.step(60)
    np.testing.assert_array_equal(run.now.body_q.numpy(), start)
    assert run.x[:, 2].min() >= 0.0


@pytest.mark.parametrize(("kind", "line"), [("prismatic", 0), ("revolute", 3)])
def test_a_force_along_a_joint_pushes_both_bodies_apart(device, kind, line, add_block, run_of):
    builder = pair(kind, axis=newton.Axis["XYZ"[line % 3]])
    add_block(builder, FAR)
    run = run_of(builder, device)
    run.control = run.model.control()
    push = run.control.joint_f.numpy()
    push[-1] = 2.0
    run.control.joint_f.assign(push)
    run.step(10)
    of = run.model.body_inertia.numpy()[0, 0, 0] if line == 3 else run.model.body_mass.numpy()[0]
    want = np.zeros((2, 6))
    want[:, line] = 2.0 * 10 * DT / of * np.array([-1.0, 1.0])
    np.testing.assert_allclose(run.now.body_qd.numpy(), want, atol=1e-3 * want.max())  # of fits


def test_a_force_beside_the_centres_of_mass_gives_no_momentum(device, add_block, run_of):
    builder = pair("prismatic", axis=newton.Axis.Y)
    add_block(builder, FAR)
    run = run_of(builder, device)
    push = np.zeros(run.model.joint_dof_count, dtype=np.float32)
    push[-1] = 2.0
    run.model.joint_f.assign(push)
    run.step(10)
    v, mass = run.now.body_qd.numpy()[1, 1], run.model.body_mass.numpy()[1]
    assert v > 0.01
    arms = np.array([1.0, 1.0, 1.0, 0.15, 0.15, 0.15])  # [m] of momenta that are opposite
    # It turns by a seventh of a radian, in steps of second order.
    np.testing.assert_allclose(momentum_of(run) / arms, 0.0, atol=5e-3 * v * mass)


def test_the_force_of_a_free_joint_acts_at_the_centre_of_mass(device, add_block, run_of):
    builder = newton.ModelBuilder(gravity=NONE)
    add_block(builder, FAR)
    ball = builder.add_body(xform=wp.transform(wp.vec3(1, 2, 3), wp.quat_rpy(0.3, 0.2, 0.1)))
    builder.add_shape_sphere(ball, xform=at(0.2), radius=0.1)
    run = run_of(builder, device)
    run.model.joint_f.assign(np.array([0.0, 3.0, 0.0, 0.0, 0.0, 0.0], dtype=np.float32))
    run.step(5)
    want = np.array([0.0, 3.0 * 5 * DT / run.model.body_mass.numpy()[0], 0, 0, 0, 0])
    np.testing.assert_allclose(run.now.body_qd.numpy()[0], want, atol=1e-4 * want[1])


REFUSED = {
    "joint_limit_upper of joint 'between' is set": {"limit_upper": 1.0},
    "joint_target_ke of joint 'between'": {"target_ke": 1.0},
    "joint_damping of joint 'between'": {"damping": 1.0},
    "joint_stiffness of joint 'between'": {"stiffness": 1.0},
    "joint_friction of joint 'between'": {"friction": 1.0},
    "joint_armature of joint 'between'": {"armature": 1.0},
    "touch in this model, and are of bodies with a joint": {"collision_filter_parent": False},
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_a_joint_has_more_is_refused(device, message, add_block):
    builder = pair("revolute", **REFUSED[message])
    add_block(builder, FAR)
    with pytest.raises(ValueError, match=message):
        SolverContactSurface(builder.finalize(device=device))


def test_a_joint_of_another_kind_is_refused(device, add_block):
    builder = pair("distance", max_distance=1.0)
    add_block(builder, FAR)
    with pytest.raises(ValueError, match=r"'between' \(DISTANCE"):
        SolverContactSurface(builder.finalize(device=device))


def test_a_joint_is_closed_where_joint_q_has_it_or_refused(device, add_block):
    builder = pair("ball")
    add_block(builder, FAR)
    model = builder.finalize(device=device)
    solver = SolverContactSurface(model)
    place = model.joint_X_c.numpy()
    place[-1, 1] = 0.1
    model.joint_X_c.assign(place)
    solver.notify_model_changed(newton.ModelFlags.JOINT_PROPERTIES)
    state = model.state()
    solver.reset(state)
    np.testing.assert_allclose(state.body_q.numpy()[1, :3], [0.3, -0.1, 0.0], atol=1e-6)
    slid = pair("prismatic", axis=newton.Axis.Y)
    slid.body_q[1] = at(0.3, 0.07)  # and joint_q says 0
    add_block(slid, FAR)
    start = SolverContactSurface(slid.finalize(device=device))._layout.start[2]
    np.testing.assert_allclose(start[1, :3], [0.3, 0.07, 0.0], atol=1e-6)
    builder.add_joint_ball(-1, 1, parent_xform=at(9.0), label="loop")
    with pytest.raises(ValueError, match="'loop' is closed neither"):
        SolverContactSurface(builder.finalize(device=device))


def hang(builder, stiffness, damping=0.0, off=0.0):
    """A block of which the top is held by a plate below which it hangs."""
    plate = builder.add_body(xform=at(0.05, 0.05, 0.11), is_kinematic=True)
    builder.add_shape_box(plate, hx=0.05, hy=0.05, hz=0.005)
    top = [k for k, x in enumerate(builder.particle_q) if x[2] > 0.099]
    for k in top:
        point = np.array(builder.particle_q[k]) - [0.05, 0.05, 0.11 + off]
        more = {"body_point": wp.vec3(*point), "stiffness": stiffness, "damping": damping}
        builder.add_attachment_particle_body(k, plate, **more)
    return top


@pytest.mark.parametrize("stiffness", [np.inf, 2e3])
def test_particles_that_are_attached_hang_from_a_body(device, stiffness, add_block, run_of):
    builder = newton.ModelBuilder()
    add_block(builder, NONE, k_damp=2e3)
    top = hang(builder, stiffness)
    run = run_of(builder, device)
    run.step(240)
    mass = run.solver.simulation.model.mass.numpy()[: run.model.particle_count].sum()
    sag = run.model.particle_q.numpy()[top, 2] - run.x[top, 2]
    if np.isinf(stiffness):
        np.testing.assert_allclose(sag, 0.0, atol=1e-5)
        return
    # The sum of the springs carries the weight, to what is left of its vibrations.
    np.testing.assert_allclose(stiffness * sag.sum(), mass * 9.81, rtol=0.02)


@pytest.mark.parametrize(
    ("message", "more"), [("has a damping", {"damping": 1.0}), ("0.01 m apart", {"off": 0.01})]
)
def test_an_attachment_that_is_damped_or_apart_is_refused(device, message, more, add_block):
    builder = newton.ModelBuilder()
    add_block(builder, NONE)
    hang(builder, 1e3, **more)
    with pytest.raises(ValueError, match=f"attachment 0 of particle .* {message}"):
        SolverContactSurface(builder.finalize(device=device))


def test_an_attachment_of_a_particle_without_tets_is_refused(device, add_block):
    builder = newton.ModelBuilder()
    add_block(builder, NONE)
    ball = builder.add_body(xform=at(2.0))
    builder.add_shape_sphere(ball, radius=0.1)
    loose = builder.add_particle(wp.vec3(2.0, 0.0, 0.0), wp.vec3(), 0.0)
    builder.add_attachment_particle_body(loose, ball)
    with pytest.raises(ValueError, match="particle 27, which is of no tet"):
        SolverContactSurface(builder.finalize(device=device))
