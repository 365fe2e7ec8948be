"""newton/: rigid bodies and shapes of Newton; what cannot be simulated is refused by name."""

import numpy as np
import pytest

newton = pytest.importorskip("newton", "1.8")
import warp as wp  # noqa: E402

from warp_contact.newton import SolverContactSurface  # noqa: E402

NONE = (0.0, 0.0, 0.0)
STILL = wp.quat_identity()
DT = 1.0 / 240.0


def add_ball(builder, at, radius=0.05, **more) -> int:
    ball = builder.add_body(xform=wp.transform(wp.vec3(*at), STILL), **more)
    builder.add_shape_sphere(ball, radius=radius)
    return ball


def test_a_rigid_ball_falls_turns_and_is_pushed(device, add_block, run_of):
    builder = newton.ModelBuilder()
    add_block(builder, (1.0, 0.0, 0.0))
    add_ball(builder, (0.0, 0.0, 0.0))
    run = run_of(builder, device)
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


def test_a_driven_body_pushes_a_soft_one(device, add_block, run_of):
    builder = newton.ModelBuilder(gravity=NONE)
    add_block(builder, (0.0, 0.0, 0.0))
    add_ball(builder, (-0.06, 0.05, 0.05), is_kinematic=True)
    run = run_of(builder, device)
    for k in range(10):
        pose = run.now.body_q.numpy().copy()
        pose[0, 0] = -0.06 + 0.002 * (k + 1)
        run.now.body_q.assign(pose)
        run.step()
    assert run.force.sum(axis=0)[0] > 0.0 and run.now.body_q.numpy()[0, 0] == pose[0, 0]
    assert run.now.particle_qd.numpy()[:, 0].mean() > 0.0


@pytest.mark.parametrize("shape", ["box", "sphere", "cylinder", "capsule", "mesh", "plane"])
def test_a_static_shape_holds_a_block(device, shape, add_block, run_of):
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
    run = run_of(builder, device)
    run.step(40)
    assert run.force[:, 2].sum() > 0.0 and run.x[:, 2].min() > -0.01  # a ball dents it


def test_a_body_of_several_shapes_is_one_of_them_all(device, add_block, run_of):
    builder = newton.ModelBuilder()
    builder.add_ground_plane()
    add_block(builder, (0.0, 0.0, 1e-4))
    # A bridge over the block: a slab, which hangs over at one side, on two legs that it covers.
    bridge = builder.add_body(xform=wp.transform(wp.vec3(0.05, 0.05, 0.2), STILL))
    for x, z, half, height in ((0.02, 0.0, 0.17, 0.01), (-0.1, -0.1, 0.01, 0.1)):
        place = wp.transform(wp.vec3(x, 0.0, z), STILL)
        builder.add_shape_box(bridge, xform=place, hx=half, hy=0.05, hz=height)
    place = wp.transform(wp.vec3(0.1, 0.0, -0.1), STILL)
    builder.add_shape_cylinder(bridge, xform=place, radius=0.01, half_height=0.1)
    run = run_of(builder, device)
    layout = run.solver._layout
    material = layout.scene.bodies[layout.solid[0].index].material
    model = run.model
    np.testing.assert_allclose(material.mass, model.body_mass.numpy()[0], rtol=1e-6)
    np.testing.assert_allclose(material.centre, model.body_com.numpy()[0], atol=1e-7)
    np.testing.assert_allclose(material.inertia, model.body_inertia.numpy()[0], rtol=1e-5)
    run.step(60)
    q = run.now.body_q.numpy()[0]
    # It stands on its legs, level, and the block below touches nothing but the ground.
    np.testing.assert_allclose(q[:3], [0.05, 0.05, 0.2], atol=1e-4)
    np.testing.assert_allclose(q[3:], [0.0, 0.0, 0.0, 1.0], atol=2e-3)
    forces = run.solver.simulation.forces()
    (pair,) = [pair for pair in forces if "body 0 'body_0'" in pair]
    weight = float(model.body_mass.numpy()[0]) * 9.81
    assert pair[1] == "plane0"
    np.testing.assert_allclose(forces[pair].total[2], weight, rtol=0.05)  # it still trembles


def test_shapes_side_by_side_are_joined_and_must_have_one_friction(device, add_block):
    builder = newton.ModelBuilder()
    add_block(builder, (0.0, 0.0, 0.0))
    body = builder.add_body(xform=wp.transform(wp.vec3(5.0, 0.0, 0.0), STILL), label="pair")
    for x in 0.1, 0.3:
        place = wp.transform(wp.vec3(x, 0.0, 0.0), STILL)
        builder.add_shape_box(body, xform=place, hx=0.1, hy=0.1, hz=0.1)
    solver = SolverContactSurface(builder.finalize(device=device))  # no warning of seams
    mesh = solver._layout.scene.bodies[1].mesh
    assert mesh.n_pieces == 1 and mesh.volume == pytest.approx(0.016)
    builder.shape_material_mu[-1] = 0.1
    with pytest.raises(ValueError, match="'pair' has shapes with a mu of"):
        SolverContactSurface(builder.finalize(device=device))


def test_a_plane_of_one_world_alone_is_refused(device, add_block):
    builder = newton.ModelBuilder()
    for ground in True, False:
        one = newton.ModelBuilder()
        add_block(one, (0.0, 0.0, 0.0))
        if ground:
            one.add_ground_plane()
        builder.add_world(one)
    with pytest.raises(ValueError, match="is not in all worlds"):
        SolverContactSurface(builder.finalize(device=device))


def test_after_a_step_that_fails_the_next_one_begins_where_its_state_is(
    device, monkeypatch, add_block, run_of
):
    builder = newton.ModelBuilder(gravity=NONE)
    add_block(builder, (0.0, 0.0, 0.0))
    add_ball(builder, (0.0, 0.0, 1.0))
    run = run_of(builder, device)
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
