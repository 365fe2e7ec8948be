"""impulse.py and other_responses.py in closed form: a vertex against a triangle."""

import numpy as np
import pytest
import warp as wp

from warp_contact import NeoHookean, Penalty, Scene, TetMesh
from warp_contact.step import impulse, other_responses

DT = 1e-3
RUBBER = NeoHookean(1e5, 0.3, 1000.0)
TOP = [[-3.0, -2.0, 0.0], [3.0, -2.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, -5.0]]
TIP = [[0.0, 0.0, 0.0], [0.3, 0.0, 1.0], [-0.2, 0.3, 1.0], [-0.2, -0.3, 1.0]]


def tip_on_triangle(rng, friction: float, speed) -> tuple[Scene, np.ndarray]:
    """A vertex that touches a triangle at z = 0 from above; the weights of the five vertices."""
    scene = Scene(gravity=(0.0, 0.0, 0.0), friction=friction)
    scene.add_body(TetMesh(TOP, [[0, 2, 1, 3]]), RUBBER, velocity=rng.normal(size=3))
    place = np.array([*rng.uniform(-0.5, 0.5, 2), 0.0])
    v = scene.bodies[0].v[0] + speed
    scene.add_body(TetMesh(TIP, [[0, 1, 2, 3]]), RUBBER, place, velocity=v)
    w = np.linalg.solve(np.vstack([np.array(TOP)[:3, :2].T, np.ones(3)]), [*place[:2], 1.0])
    return scene, np.array([1.0, *-w])


@pytest.mark.parametrize("friction", [0.0, 0.2, 2.0])
def test_a_single_contact_is_the_inelastic_collision_of_the_text_books(
    rng, stages, find_contacts, records, friction
):
    u = np.array([*rng.uniform(-2.0, 2.0, 2), -3.0])
    scene, a = tip_on_triangle(rng, friction, u)
    model, state, work = stages(scene, dt=DT)
    v0 = state.v.numpy().astype(float)
    ahead = wp.array(state.x.numpy() + DT * v0, dtype=wp.vec3)
    find_contacts(model, work, state.x, ahead)
    impulse.exchange(model, state.v, work)
    v1, c = state.v.numpy(), records(work)
    assert c.n == 1
    who = np.array([4, 0, 1, 2])
    mass = model.mass.numpy().astype(float)[who]
    w = (a * a / mass).sum()
    normal, along = -u[2] / w, np.linalg.norm(u[:2])
    drag = min(friction * normal, along / w)
    p = np.array([*(-drag * u[:2] / along), normal])
    want = v0.copy()
    want[who] += (a / mass)[:, None] * p
    # float32 at velocities of order 1; positions 1e-7 off z = 0 turn up as a gap over DT.
    np.testing.assert_allclose(v1, want, atol=2e-4)
    np.testing.assert_allclose(c.normal_impulse, normal, rtol=1e-4)
    rubbed = np.linalg.norm(c.friction_impulse, axis=1)
    np.testing.assert_allclose(rubbed, drag, rtol=1e-4, atol=1e-9)


def test_a_contact_that_opens_gets_nothing(rng, stages, find_contacts, records):
    scene, _ = tip_on_triangle(rng, 0.3, np.array([1.0, 0.0, 2.0]))
    model, state, work = stages(scene, dt=DT)
    x = state.x.numpy()
    x[4:, 2] -= 1e-3
    find_contacts(model, work, state.x, wp.array(x, dtype=wp.vec3))
    v0 = state.v.numpy().copy()
    impulse.exchange(model, state.v, work)
    assert records(work).n == 1
    np.testing.assert_array_equal(state.v.numpy(), v0)


def test_sticking_across_a_gap_stops_the_slip_as_the_turning_triangle_sees_it(
    rng, stages, find_contacts, records
):
    gap = 0.01
    scene, _ = tip_on_triangle(rng, 50.0, np.array([1.0, -2.0, -30.0]))
    scene.bodies[0].v[:3, 2] += rng.uniform(1.0, 3.0, 3) * [1.0, -1.0, 0.0]
    model, state, work = stages(scene, dt=DT)
    x = state.x.numpy().copy()
    x[4:, 2] += gap
    state.x.assign(x)
    ahead = wp.array(x + DT * state.v.numpy(), dtype=wp.vec3)
    find_contacts(model, work, state.x, ahead)
    impulse.exchange(model, state.v, work)
    v, c = state.v.numpy().astype(float), records(work)
    n, corners = c.normal[0].astype(float), np.array(TOP)[:3]
    b = np.cross(n, np.roll(corners, 1, axis=0) - np.roll(corners, -1, axis=0))
    b /= n @ np.cross(corners[1] - corners[0], corners[2] - corners[0])  # grad w
    slide = c.coef[0] @ v[c.vert[0]] - (c.coef[0] @ v[c.vert[0]] @ n) * n
    order = [list(c.vert[0, 2:]).index(i) for i in range(3)]
    turning = gap * (v[c.vert[0, 2:]] @ n)[order] @ b
    print(f"slide {slide}, turning {turning}")
    # To the second order of gap / edge times 30 m/s, which further sweeps would take up.
    np.testing.assert_allclose(slide + turning, 0.0, atol=2e-4)
    assert np.linalg.norm(turning) > 1e-3


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_penalty_impulse_is_stiffness_times_depth_less_damping(
    rng, stages, find_contacts, records, friction
):
    depth, response = 0.01, Penalty(stiffness=rng.uniform(1e3, 1e5), damping=rng.uniform(0.1, 1.0))
    u = np.array([1.0, -0.5, -0.7])
    scene, a = tip_on_triangle(rng, friction, u)
    model, state, work = stages(scene, dt=DT)
    x = state.x.numpy()
    x[4:, 2] -= depth
    state.x.assign(x)
    find_contacts(model, work, state.x)
    v0 = state.v.numpy().astype(float)
    other_responses._push(model, state, work, response)
    who = np.array([4, 0, 1, 2])
    mass = model.mass.numpy().astype(float)[who]
    normal = DT * (response.stiffness * depth - response.damping * u[2])
    along = np.linalg.norm(u[:2])
    drag = min(friction * normal, along / (a * a / mass).sum())
    want = v0.copy()
    want[who] += (a / mass)[:, None] * np.array([*(-drag * u[:2] / along), normal])
    # A depth of 0.01 in coordinates of order 1: 1e-5 of the impulse.
    np.testing.assert_allclose(state.v.numpy() - v0, want - v0, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(records(work).normal_impulse, normal, rtol=1e-4)


@pytest.mark.parametrize("friction", [0.0, 0.2, 2.0])
def test_a_predicted_force_is_the_overlap_over_the_step_squared_and_the_weight(
    rng, stages, find_contacts, records, friction
):
    overlap, u = 0.002, np.array([1.0, -0.5, 0.3])
    scene, a = tip_on_triangle(rng, friction, u)
    model, state, work = stages(scene, dt=DT)
    v0 = state.v.numpy().astype(float)
    ahead = state.x.numpy() + DT * v0
    ahead[4:, 2] -= overlap + DT * u[2]
    work.x.assign(ahead)
    find_contacts(model, work, state.x, work.x)
    other_responses._push_apart(model, state, work)
    who = np.array([4, 0, 1, 2])
    mass = model.mass.numpy().astype(float)[who]
    w = (a * a / mass).sum()
    normal, along = overlap / (DT * w), np.linalg.norm(u[:2])
    drag = min(friction * normal, along / w)
    want = v0.copy()
    want[who] += (a / mass)[:, None] * np.array([*(-drag * u[:2] / along), normal])
    # An overlap of 0.002 in coordinates of order 1: 1e-4 of the impulse, 2 m/s.
    np.testing.assert_allclose(state.v.numpy(), want, atol=1e-3)
    c = records(work)
    np.testing.assert_allclose(c.normal_impulse, normal, rtol=3e-4)
    np.testing.assert_allclose(np.linalg.norm(c.friction_impulse, axis=1), drag, rtol=3e-4)


def test_a_step_with_predicted_forces_closes_a_single_gap_and_keeps_the_momentum(rng, stages):
    height, down = 0.02, 30.0  # far above the margin in which a vertex outside counts
    scene, a = tip_on_triangle(rng, 0.0, np.array([0.5, -1.0, -down]))
    model, state, work = stages(scene, dt=DT, unit=1e-9)
    x = state.x.numpy()
    x[4:, 2] += height
    state.x.assign(x)
    v0, mass = state.v.numpy().astype(float), model.mass.numpy().astype(float)[:, None]
    other_responses.step_predicted(model, state, work, 0)
    x1, v1 = state.x.numpy().astype(float), state.v.numpy().astype(float)
    gap = a @ x1[[4, 0, 1, 2], 2]
    print(f"gap {gap:.1e} m, without contact {height - down * DT:.1e} m")
    # Rounding of coordinates up to 5; the normal is that of the predicted triangle, z.
    assert abs(gap) < 2e-6
    passed, carried = (np.abs(mass * v).sum() for v in (v1 - v0, v0))
    assert passed > 1e-4 * carried
    # One rounding of every velocity.
    np.testing.assert_allclose((mass * (v1 - v0)).sum(axis=0), 0.0, atol=1e-7 * carried)


def test_predicted_forces_leave_a_vertex_in_the_skin_alone(rng, stages, find_contacts, records):
    scene, _ = tip_on_triangle(rng, 0.5, np.array([1.0, 0.0, -2.0]))
    model, state, work = stages(scene, dt=DT)
    x = state.x.numpy()
    x[4:, 2] += 1e-3
    work.x.assign(x)
    find_contacts(model, work, state.x, work.x)
    v0 = state.v.numpy().copy()
    other_responses._push_apart(model, state, work)
    c = records(work)
    assert c.n == 1 and c.inv_mass[0] > 0.0 and c.depth[0] < 0.0
    np.testing.assert_array_equal(state.v.numpy(), v0)
